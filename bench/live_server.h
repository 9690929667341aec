#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "limber/v1/service.pb.h"
#include "limber/v1/stream.pb.h"

namespace limber::bench {

/// A limberd of our own on ipc sockets in a folder that goes with it.
class ServerProcess {
 public:
  /// @throws std::runtime_error where it does not start
  /// @param more  options of limberd besides; FOLDER in them is the server's own
  explicit ServerProcess(const std::string& binary, const std::vector<std::string>& more = {});
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;
  [[nodiscard]] std::string requests() const { return "ipc://" + (folder_ / "requests").string(); }
  [[nodiscard]] std::string stream() const { return "ipc://" + (folder_ / "stream").string(); }

 private:
  std::filesystem::path folder_;
  pid_t pid_ = -1;
};

/// A subscriber of the server's stream.
class LiveStream {
 public:
  LiveStream(zmq::context_t& context, const ServerProcess& server);
  void subscribe(const std::string& topic) { socket_.set(zmq::sockopt::subscribe, topic); }
  /// Whether a message is there, or comes within this time.
  [[nodiscard]] bool has_next(std::chrono::milliseconds wait);
  /// The next frames message. @throws std::runtime_error where none comes within a minute
  limber::v1::Frames next_frames();

 private:
  zmq::socket_t socket_;
};

/// Requests, one at a time, and a stream.
class LiveClient {
 public:
  explicit LiveClient(const ServerProcess& server);
  /// @throws std::runtime_error with the error of the reply, or where none comes within two minutes
  limber::v1::Reply call(limber::v1::Request request);
  void subscribe(const std::string& topic) { stream_.subscribe(topic); }
  limber::v1::Frames next_frames() { return stream_.next_frames(); }
  /// Until the result of a revision of a session is final.
  void wait_final(const std::string& session, std::uint64_t revision);
  [[nodiscard]] zmq::context_t& context() { return context_; }

 private:
  zmq::context_t context_;
  zmq::socket_t requests_;
  LiveStream stream_;
  std::uint64_t last_id_ = 0;
};

/// Opens a scene as a session and waits for its first final result.
/// @returns what the server tells of it then, with the scene
limber::v1::GetSessionResponse open_scene(LiveClient& client, const limber::v1::Scene& scene,
                                          const std::string& session);
/// The same of a sample.
limber::v1::GetSessionResponse open_sample(LiveClient& client, const std::string& sample,
                                           const std::string& session);

/// An edit that moves constraint i of a scene (in turn) by a tenth of its distance from rest, in
/// directions that change from edit to edit.
[[nodiscard]] limber::v1::Request circling_edit(const std::string& session,
                                                const limber::v1::Scene& scene, int i);

}  // namespace limber::bench
