#include "server/service/service.h"

#include <fmt/format.h>

#include <algorithm>

#include <boost/asio/post.hpp>

#include "limber/v1/stream.pb.h"
#include "server/log/log.h"
#include "server/runtime/file_roots.h"
#include "server/service/roles.h"
#include "server/wire/errors.h"
#include "server/wire/peek.h"
#include "server/wire/version.h"
#include "server/wire/wire_check.h"

namespace limber::server {
namespace {

constexpr std::uint64_t kLightBytes = 4 << 20;  // for requests handled on the transport's thread

/// By what the client calls itself, else by its connection, proxies included.
std::string client_of(const Address& address, const RequestPeek& peek) {
  if (!peek.client.empty()) return kNamedClient + peek.client;
  std::string connection = "connection";
  for (const auto& frame : address.envelope)
    connection += fmt::format(" {}:", frame.size()) + frame;
  return connection;
}

/// Edits that are soon done, of any kind; others are for the pool.
constexpr std::uint64_t kShortEditBytes = 8 << 10;
bool is_short(const proto::EditRequest& request) {
  constexpr int kEdits = 64;
  constexpr auto kSteps = 1;  // of undo: each as many changes as there are constraints
  const auto& edits = request.edits();
  return edits.size() <= kEdits &&
         std::count_if(edits.begin(), edits.end(), [](const proto::Edit& edit) {
           return edit.has_undo() || edit.has_redo();
         }) <= kSteps;
}

/// The session reference in its body; empty if it has none.
std::string called_session(const proto::Request& request) {
  const auto& reflection = *request.GetReflection();
  const auto* body =
      reflection.GetOneofFieldDescriptor(request, request.GetDescriptor()->FindOneofByName("body"));
  if (body == nullptr) return "";
  const auto& message = reflection.GetMessage(request, body);
  const auto* session = message.GetDescriptor()->FindFieldByName("session");
  if (session == nullptr || session->type() != google::protobuf::FieldDescriptor::TYPE_STRING)
    return "";
  return message.GetReflection()->GetString(message, session);
}

/// Replaces a session's name for edits whose session cannot be peeked. No name: it has a character
/// that none has.
constexpr const char* kHiddenSession = "?";

proto::Request parse(const zmq::message_t& payload) {
  check_wire(payload.to_string_view(), *proto::Request::descriptor());
  proto::Request request;
  if (!request.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) {
    throw malformed("the bytes are not a limber.v1.Request (a string that is not UTF-8?)");
  }
  return request;
}

/// Requests that open a session or begin a job.
bool begins_work(proto::Request::BodyCase body) {
  using Request = proto::Request;
  switch (body) {
    case Request::kOpenSession:
    case Request::kRestoreSession:
    case Request::kSolveCold:
    case Request::kTetrahedralize:
    case Request::kSimulate:
    case Request::kRecover:
    case Request::kStartDesign:
    case Request::kSolveBeams:
      return true;
    default:
      return false;
  }
}

/// @param next  another run with its sessions takes the request
Refusal draining(NextRun next) {
  return shutting_down(next,
                       "the server is draining: it will end, and takes no new sessions and jobs");
}

void check_envelope(const Address& address, const RequestPeek& peek) {
  // All but the routing id must end with an empty frame: otherwise the payload was cut into
  // several.
  if (address.envelope.size() > 1 && !address.envelope.back().empty()) {
    throw malformed(
        "several frames where one is expected: an empty frame must come before the message");
  }
  if (!peek.fault.empty()) throw malformed(peek.fault);
  if (peek.version != kProtocolVersion) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "version", other_protocol(peek.version),
                  {{"version", std::to_string(peek.version)},
                   {"supported", std::to_string(kProtocolVersion)},
                   {"server_version", server_version()}});
  }
}

}  // namespace

Service::Service(Hub& hub, Kinds kinds, std::function<void()> request_stop)
    : hub_(hub),
      kinds_(std::move(kinds)),
      scenes_{FileRoots(hub.options.mesh_roots).resolver(), hub.options.limits},
      request_stop_(std::move(request_stop)),
      sessions_(hub.options.limits.sessions, hub.run, hub.session_ids),
      kept_(hub, kinds_, scenes_, sessions_),
      waiting_bytes_(hub.options.limits.queued_request_bytes),
      heavy_(hub.request_pool, hub.options.request_threads, waiting_bytes_,
             [this](HeavyRequests::Request request) {
               if (!pass_to_patient(request)) work_on(std::move(request));
             }),
      patient_(hub.patient_request_pool, hub.options.request_threads, waiting_bytes_,
               [this](HeavyRequests::Request request) { work_patiently_on(std::move(request)); }) {
  kept_.recall(replies_);
}

void Service::handle(Address address, zmq::message_t payload) noexcept try {
  const RequestPeek peek = peek_request(payload.to_string_view());
  const Address original = address;
  const auto ticket = std::make_shared<Ticket>(hub_.transport, hub_.counters, hub_.open_requests,
                                               std::move(address), peek.id, hub_.run.instance);
  ticket->note_client_number(clients_.note(ticket->client()));
  try {
    if (payload.size() > hub_.options.transport.message_bytes) {
      throw limit_exceeded("", "bytes of a request", hub_.options.transport.message_bytes,
                           payload.size());
    }
    check_envelope(original, peek);
    const bool is_of_another_run = !peek.instance.empty() && peek.instance != hub_.run.instance;
    if (is_of_another_run && (peek.body == Request::kShutdown || !kept_.had(peek.instance)))
      throw restarted("", "");
    demand_role(ticket->role(), peek.body);
    if (hub_.stopping.load()) throw hub_.going_down();
    if (verb_of(peek.body).effect == Effect::kLasting) {
      ticket->note_lasting();
    } else if (peek.most_reply_bytes != 0 && peek.body != Request::kGetReplyPart) {
      ticket->divide_reply(reply_parts_, peek.most_reply_bytes);
    }
    if (came_before(ticket, original, peek, payload)) return;
    dispatch(ticket, peek.body, std::move(payload));
  } catch (const Refusal& refusal) {
    if (refusal.code() == proto::ERROR_CODE_MALFORMED)
      hub_.counters.malformed.fetch_add(1, std::memory_order_relaxed);
    ticket->refuse_unbegun(refusal);
  } catch (const std::exception& fault) {
    ticket->refuse_unbegun(fault);
  }
} catch (const std::exception& fault) {  // no memory even for the refusal
  hub_.counters.dropped_requests.fetch_add(1, std::memory_order_relaxed);
  log::error("request dropped: {}", fault.what());
}

bool Service::came_before(const SharedTicket& ticket, const Address& address,
                          const RequestPeek& peek, const zmq::message_t& payload) {
  if (peek.id == 0 || verb_of(peek.body).effect == Effect::kNone) return false;
  RequestKey key{client_of(address, peek), peek.id};
  const std::uint64_t hash = content_hash(payload.to_string_view());
  auto finding = replies_.begin(key, hash, ticket, StoredReplies::Clock::now());
  using Verdict = StoredReplies::Verdict;
  switch (finding.verdict) {
    case Verdict::kNew:
      ticket->keep_reply(replies_, std::move(key), hash);
      return false;
    case Verdict::kDifferent:
      throw invalid("id", fmt::format("request id {} was used for another request: every request "
                                      "that changes something needs an id of its own (or 0)",
                                      peek.id));
    case Verdict::kTooLarge:
      throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "id",
                    fmt::format("request {} was answered before, and its reply was too large to "
                                "be kept",
                                peek.id));
    case Verdict::kAnswered:
      ticket->answer_again(std::move(finding.reply));
      break;
    case Verdict::kRunning:
      break;
  }
  hub_.counters.repeated_requests.fetch_add(1, std::memory_order_relaxed);
  return true;
}

void Service::dispatch(const SharedTicket& ticket, int body, zmq::message_t payload) {
  const bool large = payload.size() > kLightBytes;
  const bool is_heavy = verb_of(body).lane != Lane::kLight;
  const bool is_edit = body == proto::Request::kEdit;
  // For NAME and NAME@UID, the name: requests of both are in one order.
  std::string session = peek_session(payload.to_string_view(), body);
  session.resize(std::min(session.size(), session.find('@')));
  // Edits that hide their session are all in one order, behind nothing else.
  if (is_edit && session.empty()) session = kHiddenSession;
  // After edits of the session that wait for a thread: later requests find these edits made.
  const bool is_behind =
      !session.empty() && (heavy_.is_busy(session) || sessions_.parked(session).has_value());
  if (!is_heavy && !(large && is_edit)) {
    if (large)
      throw limit_exceeded("", "bytes of a request of this kind", kLightBytes, payload.size());
    if (!is_behind &&
        !(is_edit && (payload.size() > kShortEditBytes || session == kHiddenSession))) {
      const Request request = parse(payload);
      if (!is_edit || is_light_edit(request)) return carry_out(ticket, request);
    }
  }
  if (is_behind && !is_heavy && payload.size() <= kShortEditBytes) {
    demand_room_behind(*ticket);
  } else {
    demand_room_of_client(*ticket);
  }
  if (verb_of(body).lane == Lane::kPatient && !is_behind)
    return patient_.add({ticket, std::move(payload)});
  heavy_.add({ticket, std::move(payload), is_edit || is_behind ? session : ""});
}

bool Service::pass_to_patient(HeavyRequests::Request& request) {
  if (request.session.empty()) return false;
  const RequestPeek peek = peek_request(request.payload.to_string_view());
  if (verb_of(peek.body).lane != Lane::kPatient) return false;
  const SharedTicket ticket = request.ticket;
  request.session.clear();
  request.number = 0;
  try {
    patient_.add(std::move(request));
  } catch (const Refusal& refusal) {
    ticket->refuse_unbegun(refusal);
  }
  return true;
}

void Service::work_patiently_on(HeavyRequests::Request request) {
  Hub::give_way();
  work_on(std::move(request));
}

bool Service::is_light_edit(const Request& request) const {
  if (!is_short(request.edit()) || kinds_.are_heavy(request.edit())) return false;
  const std::string& reference = request.edit().session();
  const auto record = sessions_.look_up(reference.substr(0, reference.find('@')));
  return !record || record->edits_are_light();
}

/// Its faults are the reply, which a repetition gets, too: something may have been done.
void Service::carry_out(const SharedTicket& ticket, const Request& request) {
  try {
    demand_role(ticket->role(), request.body_case());  // which may hide from handle()
    if (hub_.phase.load() == Phase::kDraining && begins_work(request.body_case()))
      return static_cast<void>(ticket->refuse_unbegun(draining(hub_.next_run())));
    (this->*verb_of(request.body_case()).handle)(ticket, request);
  } catch (const ParkedMeanwhile&) {
    boost::asio::post(hub_.request_pool,
                      [this, ticket, request] { carry_out_again(ticket, request); });
  } catch (const Error& fault) {
    if (fault.code() == ErrorCode::kFailedPrecondition && wait_for_return(ticket, request)) return;
    ticket->refuse(fault);
  } catch (const std::exception& fault) {
    ticket->refuse(fault);
  }
}

/// For the missing parts of a session that has just come back from the store.
bool Service::wait_for_return(const SharedTicket& ticket, const Request& request) {
  const std::string session = called_session(request);
  const auto record = sessions_.look_up(session.substr(0, session.find('@')));
  return record &&
         record->wait_for_return([this, ticket, request] { carry_out_again(ticket, request); });
}

/// The session that it asked was parked before it was reached: it is brought back.
void Service::carry_out_again(const SharedTicket& ticket, const Request& request) {
  try {
    (this->*verb_of(request.body_case()).handle)(ticket, request);
  } catch (const std::exception& fault) {
    ticket->refuse(fault);
  }
}

void Service::park_idle() {
  if (is_parking_.exchange(true)) return;
  boost::asio::post(hub_.request_pool, [this] {
    reply_parts_.sweep(ReplyParts::Clock::now());
    kept_.parking().park_idle();
    is_parking_.store(false);
  });
}

void Service::work_on(HeavyRequests::Request heavy) {
  const auto& ticket = heavy.ticket;
  try {
    if (hub_.stopping.load()) throw hub_.going_down();
    const Request request = parse(heavy.payload);
    if (request.has_edit() && heavy.payload.size() > kLightBytes &&
        !kinds_.may_be_large(request.edit())) {
      throw limit_exceeded("", "bytes of a request of this kind", kLightBytes,
                           heavy.payload.size());
    }
    heavy.payload.rebuild();  // its bytes live on in the request
    carry_out(ticket, request);
  } catch (const Refusal& refusal) {
    if (refusal.code() == proto::ERROR_CODE_MALFORMED)
      hub_.counters.malformed.fetch_add(1, std::memory_order_relaxed);
    ticket->refuse(refusal);
  } catch (const std::exception& fault) {
    ticket->refuse(fault);
  }
}

void Service::publish_all_parked() {
  for (const auto& parked : sessions_.all_parked()) publish_parked(hub_, parked);
}

void Service::subscribed(const std::string& prefix, Has has) {
  for (const auto& record : sessions_.all()) record->welcome(prefix, has);
  for (const auto& parked : sessions_.all_parked()) {
    if (status_topic(parked.key.name).starts_with(prefix)) publish_parked(hub_, parked);
  }
  if (std::string(kJobsTopic).compare(0, prefix.size(), prefix) != 0) return;
  hub_.jobs.publish_running();
}

void Service::gone(const std::string& client) {
  drop_waiting(client);
  reply_parts_.drop(client);
}

void Service::drop_waiting(const std::string& client) {
  for (HeavyRequests* const line : {&heavy_, &patient_}) {
    for (auto& request : line->take(client)) {
      const auto heir = request.ticket->abandon();
      if (!heir) continue;
      try {
        line->add({heir, std::move(request.payload), std::move(request.session), request.number});
      } catch (const Refusal& refusal) {
        heir->refuse_unbegun(refusal);
      }
    }
  }
}

void Service::disconnected(const std::string& client) {
  leave_all(client);
  reply_parts_.drop(client);
  if (hub_.open_requests.of(client) == 0) return;
  drop_waiting(client);
  for (const auto& record : sessions_.all()) record->waiters().abandon(client);
  hub_.jobs.abandon(client);
}

void Service::refuse_waiting(const Refusal& refusal) {
  for (HeavyRequests* const line : {&heavy_, &patient_}) {
    for (auto& request : line->take_all()) request.ticket->refuse(refusal);
  }
}

void Service::demand_room_of_client(const Ticket& ticket) const {
  const std::uint64_t open = hub_.open_requests.of(ticket.client());
  const std::uint64_t limit = hub_.options.limits.client_requests;
  if (open > limit)
    throw limit_exceeded("body", "requests of this client that wait or run", limit, open);
}

void Service::demand_room_behind(const Ticket& ticket) const {
  constexpr std::uint64_t kMaxRequestsBehind = 20'000;
  const std::uint64_t open = hub_.open_requests.of(ticket.client());
  if (open > kMaxRequestsBehind)
    throw limit_exceeded("body", "requests of this client behind running edits", kMaxRequestsBehind,
                         open);
}

void Service::demand_room_to_wait(const Ticket& ticket) const {
  demand_room_of_client(ticket);
  if (hub_.open_requests.of(ticket.client()) <= hub_.options.limits.sure_requests) return;
  const std::uint64_t waiting = hub_.open_requests.total();
  const std::uint64_t limit = hub_.options.limits.waits;
  if (waiting > limit) throw limit_exceeded("body", "requests that wait", limit, waiting);
}

std::string Service::overflow_reply(const Address& address,
                                    const UnreadReplies::Excess& excess) const {
  const bool is_own = excess.of == UnreadReplies::Excess::Of::kClient;
  proto::Reply reply;
  reply.set_version(kProtocolVersion);
  reply.set_id(address.request_id);
  reply.set_instance(hub_.run.instance);
  *reply.mutable_error() = error_to_proto(Refusal(
      proto::ERROR_CODE_LIMIT_EXCEEDED, "",
      fmt::format("With this reply {} would have {} bytes of unread replies (limit {}); read "
                  "replies before you send more requests.",
                  is_own ? "this client" : "all clients together", excess.value, excess.limit),
      {{"limit", std::to_string(excess.limit)}, {"value", std::to_string(excess.value)}}));
  return reply.SerializeAsString();
}

}  // namespace limber::server
