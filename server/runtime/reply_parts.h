#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "limber/v1/service.pb.h"
#include "server/transport/unread_replies.h"

namespace limber::server {

namespace proto = limber::v1;

/// Long replies that clients fetch in parts (parts.proto). Each is kept until the part with its end
/// is made, its connection ends, or its requests have stopped for a while. Any thread.
class ReplyParts {
 public:
  using Clock = std::chrono::steady_clock;
  /// A reply without requests for so long is removed by the next sweep.
  static constexpr std::chrono::seconds kPatience{60};
  /// Limit of a part [bytes]: it is made between two acknowledgements.
  static constexpr std::uint64_t kMostBytes = 1 << 20;
  /// Replies kept for one client; the one that was begun first goes for another.
  static constexpr std::size_t kMostOfClient = 16;

  /// @param client  its routing id: other clients get no part
  /// @param reply       serialised
  /// @param unread      holds its bytes
  /// @param most_bytes  of the first part, > 0
  [[nodiscard]] proto::GetReplyPartResponse begin(const std::string& client, std::string reply,
                                                  UnreadReplies::Hold unread,
                                                  std::uint64_t most_bytes, Clock::time_point now);
  /// @throws Error{kFailedPrecondition, "reply"}; Refusal INVALID_ARGUMENT
  [[nodiscard]] proto::GetReplyPartResponse part(const std::string& client,
                                                 const proto::GetReplyPartRequest& request,
                                                 Clock::time_point now);
  /// Those of a connection that has ended.
  void drop(const std::string& client);
  void sweep(Clock::time_point now);
  [[nodiscard]] std::size_t size() const;

 private:
  struct Reply {
    std::string bytes;
    UnreadReplies::Hold unread;
    Clock::time_point used;  // with the lock
  };
  using SharedReply = std::shared_ptr<Reply>;
  using Replies = std::map<std::uint64_t, SharedReply>;  // by number

  static proto::GetReplyPartResponse cut(std::uint64_t number, const std::string& bytes,
                                         std::uint64_t offset, std::uint64_t most_bytes);

  mutable std::mutex mutex_;
  std::unordered_map<std::string, Replies> by_client_;  // only those that have some
  std::uint64_t last_ = 0;                              // number
};

}  // namespace limber::server
