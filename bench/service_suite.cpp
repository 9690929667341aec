// Real sockets, real processes: one client edits the flower, one edit after another, and times what
// a person would notice: acknowledgement, the first changed frames, the final frames.
#include <fmt/core.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <thread>
#include <zmq.hpp>

#include "bench/find_program.h"
#include "bench/suite.h"
#include "limber/v1/service.pb.h"
#include "limber/v1/stream.pb.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;
using Clock = std::chrono::steady_clock;

double since_ms(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// A limberd of our own on ipc sockets in a folder that goes with it.
class ServerProcess {
 public:
  explicit ServerProcess(const std::string& binary) {
    std::string pattern = (std::filesystem::temp_directory_path() / "limber-bench-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw std::runtime_error("cannot make a temporary folder");
    folder_ = pattern;
    const std::string ready = (folder_ / "ready").string();
    const std::vector<std::string> arguments = {
        binary, "--bind",      requests(),        "--stream",    stream(), "--ready-file",
        ready,  "--cache-dir", folder_ / "cache", "--log-level", "warn"};
    pid_ = fork();
    if (pid_ == 0) {
      std::vector<char*> argv;
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
  ~ServerProcess() {
    if (pid_ > 0) {
      kill(pid_, SIGTERM);
      waitpid(pid_, nullptr, 0);
    }
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;
  [[nodiscard]] std::string requests() const { return "ipc://" + (folder_ / "requests").string(); }
  [[nodiscard]] std::string stream() const { return "ipc://" + (folder_ / "stream").string(); }

 private:
  std::filesystem::path folder_;
  pid_t pid_ = -1;
};

class Client {
 public:
  explicit Client(const ServerProcess& server)
      : requests_(context_, ZMQ_DEALER), stream_(context_, ZMQ_SUB) {
    requests_.set(zmq::sockopt::linger, 0);
    stream_.set(zmq::sockopt::linger, 0);
    requests_.set(zmq::sockopt::rcvtimeo, 120000);
    stream_.set(zmq::sockopt::rcvtimeo, 60000);
    requests_.connect(server.requests());
    stream_.connect(server.stream());
  }

  pb::Reply call(pb::Request request) {
    request.set_version(1);
    request.set_id(++last_id_);
    requests_.send(zmq::buffer(request.SerializeAsString()), zmq::send_flags::none);
    zmq::message_t message;
    pb::Reply reply;
    do {
      if (!requests_.recv(message)) throw std::runtime_error("no reply within two minutes");
      if (message.size() == 0) continue;
      if (!reply.ParseFromArray(message.data(), static_cast<int>(message.size()))) {
        throw std::runtime_error("a reply that is no limber.v1.Reply");
      }
    } while (message.size() == 0 || reply.id() != last_id_);
    if (reply.has_error())
      throw std::runtime_error(reply.error().message() + " (" + reply.error().field() + ")");
    return reply;
  }

  void subscribe(const std::string& topic) { stream_.set(zmq::sockopt::subscribe, topic); }

  /// The next frames message of the stream.
  pb::Frames next_frames() {
    while (true) {
      zmq::message_t topic;
      zmq::message_t body;
      if (!stream_.recv(topic) || !stream_.recv(body))
        throw std::runtime_error("the stream is silent");
      pb::StreamMessage message;
      if (!message.ParseFromArray(body.data(), static_cast<int>(body.size()))) {
        throw std::runtime_error("a stream message that is no limber.v1.StreamMessage");
      }
      if (message.has_frames()) return message.frames();
    }
  }

 private:
  zmq::context_t context_;
  zmq::socket_t requests_;
  zmq::socket_t stream_;
  std::uint64_t last_id_ = 0;
};

struct Latencies {
  std::vector<double> ack, first_frame, converged;
};

void wait_final(Client& client, const std::string& session, std::uint64_t revision) {
  pb::Request wait;
  wait.mutable_wait()->set_session(session);
  wait.mutable_wait()->set_revision(revision);
  wait.mutable_wait()->set_until(pb::WaitRequest::UNTIL_FINAL);
  wait.mutable_wait()->set_timeout_s(120);
  client.call(wait);
}

/// Moves the constraints in turn by up to a tenth of their distance from rest, waiting for the
/// final frames each time.
Latencies edit_one_by_one(Client& client, const std::string& session, const pb::Scene& scene,
                          int edits) {
  Latencies latencies;
  for (int i = 0; i < edits; ++i) {
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
    const auto start = Clock::now();
    const std::uint64_t revision = client.call(request).edit().revision();
    latencies.ack.push_back(since_ms(start));
    bool first = true;
    while (true) {
      const pb::Frames frames = client.next_frames();
      if (frames.result().revision() < revision) continue;
      if (first) latencies.first_frame.push_back(since_ms(start));
      first = false;
      if (frames.result().converged()) break;
    }
    latencies.converged.push_back(since_ms(start));
  }
  return latencies;
}

}  // namespace

void service_suite(const SuiteOptions& options, Recorder& recorder) {
  const ServerProcess server(find_program("limberd", options.limberd));
  Client client(server);
  pb::Request get_sample;
  get_sample.mutable_get_sample()->set_name("flower");
  pb::Scene scene = client.call(get_sample).get_sample().scene();

  pb::Request open;
  *open.mutable_open_session()->mutable_scene() = scene;
  open.mutable_open_session()->set_session("bench");
  recorder.note("service: building the flower's model");
  client.call(open);
  wait_final(client, "bench", 0);
  pb::Request get;
  get.mutable_get_session()->set_session("bench");
  get.mutable_get_session()->set_with_scene(true);
  const pb::GetSessionResponse opened = client.call(get).get_session();
  scene = opened.scene();
  client.subscribe("session/bench/body/0/coordinates");
  std::this_thread::sleep_for(
      std::chrono::milliseconds(300));  // until the subscription has arrived

  const int edits = options.quick ? 500 : 2000;
  recorder.note(fmt::format("service: {} edits, one by one", edits));
  edit_one_by_one(client, "bench", scene, 20);  // warm-up, not counted
  const Latencies latencies = edit_one_by_one(client, "bench", scene, edits);

  Case result;
  result["scene"] = "flower";
  result["tets"] = opened.status().tets();
  result["frames"] = opened.status().frames();
  result["constraints"] = opened.status().constraints();
  result["basis"] = opened.status().model().basis_size();
  result["cubature_tets"] = opened.status().model().cubature_size();
  result["edits"] = edits;
  result["edit_to_ack_p50_ms"] = quantile(latencies.ack, 0.5);
  result["edit_to_ack_p99_ms"] = quantile(latencies.ack, 0.99);
  result["edit_to_first_frame_p50_ms"] = quantile(latencies.first_frame, 0.5);
  result["edit_to_first_frame_p99_ms"] = quantile(latencies.first_frame, 0.99);
  result["edit_to_converged_p50_ms"] = quantile(latencies.converged, 0.5);
  result["edit_to_converged_p99_ms"] = quantile(latencies.converged, 0.99);
  recorder.add(result);
}

}  // namespace limber::bench
