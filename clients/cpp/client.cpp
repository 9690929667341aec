#include "clients/cpp/client.h"

#include <algorithm>
#include <random>
#include <utility>

#include "clients/cpp/part_size.h"
#include "clients/cpp/reply_parts.h"
#include "clients/cpp/skew.h"

namespace limber::client {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Milliseconds kSlice{100};
/// Between requests to a server that has said that it ends, until the next one answers.
constexpr Milliseconds kFirstPause{50}, kLongestPause{1000};
/// Until a request that was sent then, and has no answer, is sent anew.
constexpr Milliseconds kFirstPatience{2000};

ClientError invalid(const std::string& field, const std::string& message) {
  return {v1::ERROR_CODE_INVALID_ARGUMENT, field, message};
}

Milliseconds left_until(Clock::time_point deadline) {
  return std::max(Milliseconds{0}, std::chrono::ceil<Milliseconds>(deadline - Clock::now()));
}

/// The message that a request brings; null where it brings none.
const google::protobuf::Message* body_of(const v1::Request& request) {
  const auto* reflection = request.GetReflection();
  const auto* member = reflection->GetOneofFieldDescriptor(
      request, v1::Request::descriptor()->FindOneofByName("body"));
  return member == nullptr ? nullptr : &reflection->GetMessage(request, member);
}

/// Jobs end with their run of limberd.
bool is_of_job(const v1::Request& request) {
  const auto* body = body_of(request);
  const auto* field = body == nullptr ? nullptr : body->GetDescriptor()->FindFieldByName("job");
  // SolveBeamsRequest has files of a job under that name.
  return field != nullptr &&
         field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_UINT64 &&
         body->GetReflection()->GetUInt64(*body, field) != 0;
}

/// Could another run of limberd take the request for something else? Jobs and sessions given as
/// NAME@UID are of one run.
bool needs_instance(const v1::Request& request) {
  if (request.has_shutdown()) return true;
  if (request.has_open_session()) return false;
  const auto* body = body_of(request);
  const auto* field = body == nullptr ? nullptr : body->GetDescriptor()->FindFieldByName("session");
  if (field == nullptr) return false;
  const std::string session = body->GetReflection()->GetString(*body, field);
  return !session.empty() && session.find('@') == std::string::npos;
}

}  // namespace

std::string random_id() {
  std::random_device random;  // of the operating system
  std::string id;
  while (id.size() < 32) id += "0123456789abcdef"[random() % 16];
  return id;
}

void ClientOptions::validate() const {
  if (timeout <= Milliseconds{0})
    throw invalid("timeout", "timeout must be > 0 ms, is " + std::to_string(timeout.count()));
  if (client_name.size() > 64)
    throw invalid("client_name", "client_name has " + std::to_string(client_name.size()) +
                                     " bytes, at most 64 are allowed");
  if (!keys) return;
  for (const auto& [name, key] :
       {std::pair{"server", &keys->server}, std::pair{"public_key", &keys->public_key},
        std::pair{"secret_key", &keys->secret_key}}) {
    if (key->size() != 40)
      throw invalid(
          std::string("keys.") + name,
          "a CURVE key is Z85 text of 40 characters, this one has " + std::to_string(key->size()));
  }
}

Client::Client(std::string endpoint, ClientOptions options)
    : endpoint_(std::move(endpoint)), options_(std::move(options)), id_(random_id()) {
  options_.validate();
  open_socket();
}

void Client::configure(zmq::socket_t& socket) const {
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::rcvhwm, 0);  // never a full queue, see Subscription
  socket.set(zmq::sockopt::heartbeat_ivl, 2000);
  socket.set(zmq::sockopt::heartbeat_timeout, 10000);
  socket.set(zmq::sockopt::reconnect_ivl, 50);
  socket.set(zmq::sockopt::reconnect_ivl_max, 2000);
  if (options_.keys) {
    socket.set(zmq::sockopt::curve_serverkey, options_.keys->server);
    socket.set(zmq::sockopt::curve_publickey, options_.keys->public_key);
    socket.set(zmq::sockopt::curve_secretkey, options_.keys->secret_key);
  }
}

void Client::open_socket() {
  try {
    zmq::socket_t socket(context_, ZMQ_DEALER);
    configure(socket);
    connections_.reset();  // before the socket that it watches
    socket_ = std::move(socket);
    connections_.emplace(context_, socket_, ZMQ_EVENT_HANDSHAKE_SUCCEEDED);
    was_connected_ = false;
    socket_.connect(endpoint_);
  } catch (const zmq::error_t& error) {
    throw invalid("endpoint", "cannot connect to '" + endpoint_ + "': " + error.what() +
                                  "; endpoints look like tcp://HOST:PORT or ipc://PATH");
  }
}

Client::Again Client::stamped(v1::Request& request) {
  request.set_version(kProtocolVersion);
  request.set_id(++last_id_);
  request.set_client(id_);
  request.set_client_name(options_.client_name);
  if (needs_instance(request)) request.set_instance(instance_);
  std::string bytes;
  if (!request.SerializeToString(&bytes))
    throw ClientError(v1::ERROR_CODE_LIMIT_EXCEEDED, "",
                      "a request of 2 GiB or more cannot be sent");
  pending_.emplace(request.id(), std::nullopt);
  return {std::move(bytes), !is_of_job(request)};
}

v1::Reply Client::ask(v1::Request& request, Milliseconds timeout, const char* what) {
  constexpr int kTries = 3;  // its parts may go with a connection
  for (int i = 0; may_have_long_answer(request) && i < kTries; ++i) {
    if (!without_parts_.empty() && without_parts_ == heard_instance_) break;
    request.set_most_reply_bytes(PartSize::kLeast);
    try {
      v1::Reply reply = ask_once(request, timeout, what);
      if (!reply.has_get_reply_part()) return reply;
      return fetch_rest(std::move(*reply.mutable_get_reply_part()), timeout, what);
    } catch (const ClientError& error) {
      if (knows_no_parts(error)) {
        without_parts_ = heard_instance_;
      } else if (!is_gone(error)) {
        throw;
      }
    }
  }
  request.clear_most_reply_bytes();
  return ask_once(request, timeout, what);
}

v1::Reply Client::ask_once(v1::Request& request, Milliseconds timeout, const char* what) {
  const Again again = stamped(request);
  send(again.bytes);
  return receive(last_id_, timeout, what, request.has_shutdown() ? nullptr : &again);
}

v1::Reply Client::fetch_rest(v1::GetReplyPartResponse first, Milliseconds timeout,
                             const char* what) {
  std::string bytes = std::move(*first.mutable_data());
  PartSize size;
  while (bytes.size() < first.total_bytes()) {
    v1::Request request;
    auto& wanted = *request.mutable_get_reply_part();
    wanted.set_reply(first.reply());
    wanted.set_offset(bytes.size());
    wanted.set_most_bytes(size.bytes());
    const auto begin = Clock::now();
    const v1::Reply reply = ask_once(request, timeout, what);
    size.note(Clock::now() - begin);
    const auto& part = reply.get_reply_part();
    if (part.offset() != bytes.size() || part.data().empty())
      throw ClientError(v1::ERROR_CODE_MALFORMED, "",
                        "a part of a long answer is not the next one");
    bytes += part.data();
  }
  v1::Reply whole;
  if (!whole.ParseFromString(bytes))
    throw ClientError(v1::ERROR_CODE_MALFORMED, "",
                      std::string("the parts of the answer to ") + what + " are not one message");
  if (whole.has_error()) throw_refusal(whole.error());
  return whole;
}

void Client::send(const std::string& bytes) {
  // A full queue means a silent server: then the deadline of the request says so.
  (void)socket_.send(zmq::buffer(bytes), zmq::send_flags::dontwait);
}

bool Client::is_connected_anew() {
  bool is_anew = false;
  while (connections_->receive() != 0) {
    is_anew = is_anew || was_connected_;
    was_connected_ = true;
  }
  return is_anew;
}

void Client::abandon(std::uint64_t id) { pending_.erase(id); }

void Client::refuse_kind(const char* what) {
  throw ClientError(v1::ERROR_CODE_MALFORMED, "",
                    std::string("the answer to ") + what + " is of a kind that this client (" +
                        client_version() + ") does not expect");
}

bool Client::wait_readable(zmq::socket_t& socket, Milliseconds timeout) const {
  const auto deadline = Clock::now() + timeout;
  zmq::pollitem_t item{socket.handle(), 0, ZMQ_POLLIN, 0};
  while (true) {
    if (options_.interrupted && options_.interrupted())
      throw ClientError(v1::ERROR_CODE_CANCELLED, "", "interrupted");
    const auto left = left_until(deadline);
    try {
      if (zmq::poll(&item, 1, std::min(left, kSlice)) > 0) return true;
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
    if (left <= Milliseconds{0}) return false;
  }
}

v1::Reply Client::receive(std::uint64_t id, Milliseconds timeout, const char* what,
                          const Again* again) {
  const auto known = pending_.find(id);
  if (known == pending_.end())
    throw ClientError(v1::ERROR_CODE_NOT_FOUND, "id",
                      "no request " + std::to_string(id) + " is in flight");
  auto deadline = Clock::now() + timeout;
  auto next_sending = again != nullptr ? deadline - timeout / 2 : deadline;
  Milliseconds pause = kFirstPause, patience = kFirstPatience;
  std::optional<v1::Error> put_off;  // by a run that ends
  const std::uint64_t heard_before = heard_;
  const auto give_up = [&](bool was_silent) {
    abandon(id);
    // Requests that wait in the socket would be executed by the next run. Requests still in flight
    // would be lost with it.
    if ((was_silent || put_off) && pending_.empty()) open_socket();
  };
  while (true) {
    if (known->second) {
      if (again == nullptr || !again->is_for_next_run ||
          !is_for_next_run(ClientError(known->second->error())))
        break;
      // The time that many megabytes may take is not for this.
      if (!put_off) deadline = std::min(deadline, Clock::now() + options_.timeout);
      put_off = std::move(*known->second->mutable_error());
      known->second.reset();
      next_sending = std::min(deadline, Clock::now() + pause);
      pause = std::min(2 * pause, kLongestPause);
    }
    bool readable = false;
    try {
      readable = wait_readable(socket_, std::min(left_until(next_sending), kSlice));
    } catch (...) {
      give_up(false);
      throw;
    }
    const bool is_anew = !readable && is_connected_anew();  // else asked the next time
    if (readable) {
      receive_one();
    } else if (is_anew && again != nullptr) {
      send(again->bytes);  // the previous connection lost its unread requests
    } else if (Clock::now() < next_sending) {
      continue;
    } else if (Clock::now() < deadline) {
      next_sending = deadline;
      if (put_off) {
        // A connection to the run that ends takes requests with it. Unanswered ones are sent anew,
        // and never wait twice in a socket.
        if (pending_.size() == 1) open_socket();
        next_sending = std::min(deadline, Clock::now() + patience);
        patience *= 2;
      }
      if (put_off || heard_ == heard_before) send(again->bytes);
    } else {
      give_up(heard_ == heard_before);
      if (put_off) throw_refusal(*put_off);
      throw Unreachable("no answer from " + endpoint_ + " to " + what + " within " +
                        std::to_string(timeout.count()) + " ms");
    }
  }
  v1::Reply reply = std::move(*known->second);
  pending_.erase(known);
  if (reply.has_error()) throw_refusal(reply.error());
  return reply;
}

void Client::receive_one() {
  zmq::message_t message;
  do {  // the envelope may bring an empty delimiter: the last part counts
    if (!socket_.recv(message, zmq::recv_flags::dontwait)) return;
  } while (message.more());
  v1::Reply reply;
  if (!reply.ParseFromArray(message.data(), static_cast<int>(message.size()))) return;
  ++heard_;
  note_instance(reply);
  const auto waiting = pending_.find(reply.id());
  if (waiting != pending_.end()) waiting->second = std::move(reply);
}

void Client::note_instance(const v1::Reply& reply) {
  const bool is_adopted =
      reply.has_open_session() || reply.error().code() == v1::ERROR_CODE_RESTARTED;
  if (!reply.instance().empty()) heard_instance_ = reply.instance();
  if (!reply.instance().empty() && (is_adopted || instance_.empty())) instance_ = reply.instance();
}

namespace {

v1::GetServerInfoResponse ask_who_is_there(Client& client, std::optional<Milliseconds> timeout,
                                           const std::string& version) {
  v1::GetServerInfoRequest request;
  request.set_client_version(version);
  return client.call(request, timeout);
}

}  // namespace

v1::GetServerInfoResponse greet(Client& client, std::optional<Milliseconds> timeout) {
  v1::GetServerInfoResponse info;
  try {
    info = ask_who_is_there(client, timeout, client_version());
  } catch (const ClientError& error) {
    if (!knows_no_client_version(error)) throw;
    info = ask_who_is_there(client, timeout, "");
  }
  const auto& spoken = info.protocol_versions();
  if (std::find(spoken.begin(), spoken.end(), kProtocolVersion) == spoken.end())
    throw ClientError(v1::ERROR_CODE_UNSUPPORTED, "version",
                      other_protocol(info.server_version(), {spoken.begin(), spoken.end()}));
  return info;
}

}  // namespace limber::client
