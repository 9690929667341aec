#include "server/transport/unread_replies.h"

#include <algorithm>

namespace limber::server {

std::optional<UnreadReplies::Hold> UnreadReplies::admit(const std::string& client,
                                                        std::uint64_t bytes, Excess& excess) {
  const std::uint64_t cost = bytes + kMessageBytes;
  const std::lock_guard lock(mutex_);
  const std::uint64_t own = replies_of(client);
  if (own > 0 && own + cost > limits_.client_bytes) {
    excess = {Excess::Of::kClient, limits_.client_bytes, own + cost};
    return std::nullopt;
  }
  if (own + cost > limits_.total_bytes - total_.replies) {
    excess = {Excess::Of::kAll, limits_.total_bytes, total_.replies + cost};
    return std::nullopt;
  }
  return hold(client, cost);
}

std::optional<UnreadReplies::Hold> UnreadReplies::admit_kept(const std::string& client,
                                                             std::uint64_t bytes) {
  const std::uint64_t cost = bytes + kMessageBytes;
  const std::lock_guard lock(mutex_);
  const std::uint64_t own = replies_of(client);
  if (own + cost > limits_.client_bytes / 2 ||
      own + cost > (limits_.total_bytes - total_.replies) / 4)
    return std::nullopt;
  return hold(client, cost);
}

std::uint64_t UnreadReplies::replies_of(const std::string& client) const {
  const auto found = by_client_.find(client);
  return found == by_client_.end() ? 0 : found->second.replies;
}

UnreadReplies::Hold UnreadReplies::hold(const std::string& client, std::uint64_t cost) {
  by_client_[client].replies += cost;
  total_.replies += cost;
  return Hold(*this, client, Kind::kReply, cost);
}

std::optional<UnreadReplies::Hold> UnreadReplies::admit_error(const std::string& client,
                                                              std::uint64_t bytes) {
  const std::uint64_t cost = bytes + kMessageBytes;
  const std::lock_guard lock(mutex_);
  Unread& own = by_client_[client];
  if (own.errors + cost > kErrorBytesOfClient || total_.errors + cost > kErrorBytes) {
    if (own.replies + own.errors == 0) by_client_.erase(client);
    return std::nullopt;
  }
  own.errors += cost;
  total_.errors += cost;
  return Hold(*this, client, Kind::kError, cost);
}

std::uint64_t UnreadReplies::total() const {
  const std::lock_guard lock(mutex_);
  return total_.replies + total_.errors;
}

std::vector<UnreadReplies::Use> UnreadReplies::uses(std::size_t most) const {
  std::vector<Use> all;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [client, unread] : by_client_)
      all.push_back({client, unread.replies + unread.errors});
  }
  std::sort(all.begin(), all.end(), [](const Use& a, const Use& b) { return a.bytes > b.bytes; });
  if (all.size() > most) all.resize(most);
  return all;
}

void UnreadReplies::release(const std::string& client, Kind kind, std::uint64_t bytes) {
  const auto part = kind == Kind::kReply ? &Unread::replies : &Unread::errors;
  const std::lock_guard lock(mutex_);
  total_.*part -= bytes;
  const auto found = by_client_.find(client);
  found->second.*part -= bytes;
  if (found->second.replies + found->second.errors == 0) by_client_.erase(found);
}

}  // namespace limber::server
