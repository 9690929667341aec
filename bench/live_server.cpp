#include "bench/live_server.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <thread>
#include <vector>

namespace limber::bench {

namespace pb = limber::v1;

ServerProcess::ServerProcess(const std::string& binary, const std::vector<std::string>& more) {
  std::string pattern = (std::filesystem::temp_directory_path() / "limber-bench-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr)
    throw std::runtime_error("cannot make a temporary folder");
  folder_ = pattern;
  const std::string ready = (folder_ / "ready").string();
  std::vector<std::string> arguments = {
      binary, "--bind",      requests(),        "--stream",    stream(), "--ready-file",
      ready,  "--cache-dir", folder_ / "cache", "--log-level", "warn"};
  for (const auto& option : more)
    arguments.push_back(option == "FOLDER" ? (folder_ / "data").string() : option);
  pid_ = fork();
  if (pid_ == 0) {
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    execv(binary.c_str(), argv.data());
    _exit(127);
  }
  for (int i = 0; i < 500 && !std::filesystem::exists(ready); ++i) {
    if (waitpid(pid_, nullptr, WNOHANG) == pid_) {
      pid_ = -1;
      throw std::runtime_error("limberd did not start: " + binary);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

ServerProcess::~ServerProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

bool LiveStream::has_next(std::chrono::milliseconds wait) {
  zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
  return zmq::poll(&item, 1, wait) > 0;
}

LiveStream::LiveStream(zmq::context_t& context, const ServerProcess& server)
    : socket_(context, ZMQ_SUB) {
  socket_.set(zmq::sockopt::linger, 0);
  socket_.set(zmq::sockopt::rcvtimeo, 60000);
  socket_.connect(server.stream());
}

pb::Frames LiveStream::next_frames() {
  while (true) {
    zmq::message_t topic;
    zmq::message_t body;
    if (!socket_.recv(topic) || !socket_.recv(body))
      throw std::runtime_error("the stream is silent");
    pb::StreamMessage message;
    if (!message.ParseFromArray(body.data(), static_cast<int>(body.size()))) {
      throw std::runtime_error("a stream message that is no limber.v1.StreamMessage");
    }
    if (message.has_frames()) return message.frames();
  }
}

LiveClient::LiveClient(const ServerProcess& server)
    : requests_(context_, ZMQ_DEALER), stream_(context_, server) {
  requests_.set(zmq::sockopt::linger, 0);
  requests_.set(zmq::sockopt::rcvtimeo, 120000);
  requests_.connect(server.requests());
}

pb::Reply LiveClient::call(pb::Request request) {
  request.set_version(1);
  request.set_id(++last_id_);
  requests_.send(zmq::buffer(request.SerializeAsString()), zmq::send_flags::none);
  zmq::message_t message;
  pb::Reply reply;
  do {
    if (!requests_.recv(message)) throw std::runtime_error("no reply within two minutes");
    if (message.empty()) continue;
    if (!reply.ParseFromArray(message.data(), static_cast<int>(message.size()))) {
      throw std::runtime_error("a reply that is no limber.v1.Reply");
    }
  } while (message.empty() || reply.id() != last_id_);
  if (reply.has_error())
    throw std::runtime_error(reply.error().message() + " (" + reply.error().field() + ")");
  return reply;
}

void LiveClient::wait_final(const std::string& session, std::uint64_t revision) {
  pb::Request wait;
  wait.mutable_wait()->set_session(session);
  wait.mutable_wait()->set_revision(revision);
  wait.mutable_wait()->set_until(pb::WaitRequest::UNTIL_FINAL);
  wait.mutable_wait()->set_timeout_s(120);
  call(wait);
}

pb::GetSessionResponse open_scene(LiveClient& client, const pb::Scene& scene,
                                  const std::string& session) {
  pb::Request open;
  *open.mutable_open_session()->mutable_scene() = scene;
  open.mutable_open_session()->set_session(session);
  client.call(open);
  client.wait_final(session, 0);
  pb::Request get;
  get.mutable_get_session()->set_session(session);
  get.mutable_get_session()->set_with_scene(true);
  return client.call(get).get_session();
}

pb::GetSessionResponse open_sample(LiveClient& client, const std::string& sample,
                                   const std::string& session) {
  pb::Request get_sample;
  get_sample.mutable_get_sample()->set_name(sample);
  return open_scene(client, client.call(get_sample).get_sample().scene(), session);
}

pb::Request circling_edit(const std::string& session, const pb::Scene& scene, int i) {
  const pb::Constraint& constraint = scene.constraints(i % scene.constraints_size());
  const pb::Vector3& from =
      constraint.has_position() ? constraint.position() : constraint.displacement();
  const double reach =
      0.1 * std::hypot(constraint.displacement().x(), constraint.displacement().y(),
                       constraint.displacement().z());
  const double angle = 2 * std::numbers::pi * 0.618034 * i;
  pb::Request request;
  request.mutable_edit()->set_session(session);
  auto* move = request.mutable_edit()->add_edits()->mutable_move();
  move->set_id(constraint.id());
  move->mutable_target()->set_x(from.x() + reach * std::cos(angle));
  move->mutable_target()->set_y(from.y() + reach * std::sin(angle));
  move->mutable_target()->set_z(from.z());
  return request;
}

}  // namespace limber::bench
