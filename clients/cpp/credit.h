#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "limber/v1/service.pb.h"
#include "limber/v1/stream.pb.h"

namespace limber::client {

/// How far a client is that follows a stream (follow.proto), and the requests that say so. Knows no
/// sockets. Not thread-safe.
class Credit {
 public:
  /// @param client_name  as ClientOptions has it
  explicit Credit(std::string client_name);

  void want(const std::string& topic) { topics_.try_emplace(topic, 0); }
  void leave(const std::string& topic) { topics_.erase(topic); }
  [[nodiscard]] bool wants(const std::string& topic) const { return topics_.contains(topic); }

  /// The bytes of a request that says all of it.
  [[nodiscard]] std::string request();
  /// Id of the request that was made last.
  [[nodiscard]] std::uint64_t id() const { return id_; }

  /// A message was read. @returns whether it is time for another request
  [[nodiscard]] bool note(const std::string& topic, const v1::StreamMessage& message,
                          const v1::StreamPosition& position);
  void note(const v1::FollowResponse& answer);
  /// Why the server has ended the stream last; empty: it never did.
  [[nodiscard]] const std::string& cut_off() const { return cut_off_; }

 private:
  const std::string client_name_, name_;
  std::map<std::string, std::uint64_t> topics_;  // and the newest message of each that was read
  std::string instance_;                         // of these
  std::uint64_t id_ = 0;
  std::uint64_t read_bytes_ = 0, granted_ = 0;  // positions: read, and last reported
  std::uint64_t window_bytes_ = 4u << 20;
  std::string cut_off_;
};

}  // namespace limber::client
