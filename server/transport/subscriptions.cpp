#include "server/transport/subscriptions.h"

#include <mutex>

namespace limber::server {

Subscriptions::Noted Subscriptions::note(std::uint64_t connection, std::string_view message) {
  if (message.empty() || (message[0] != 0 && message[0] != 1)) return Noted::kNothing;
  const std::string prefix(message.substr(1));
  const std::unique_lock lock(mutex_);
  if (message[0] == 0) {  // of a connection that has ended libzmq says so without its number
    const auto found = subscribers_.find(connection);
    if (found != subscribers_.end() && found->second.prefixes.erase(prefix) > 0) release(prefix);
    return Noted::kNothing;
  }
  Subscriber& subscriber = subscribers_[connection];
  if (subscriber.is_cut_off) return Noted::kNothing;
  const bool is_new_of_all = !prefixes_.contains(prefix);
  if (!subscriber.prefixes.contains(prefix) &&
      (subscriber.prefixes.size() >= kMaxOfOne ||
       (is_new_of_all && prefixes_.size() >= kMaxPrefixes))) {
    subscriber.is_cut_off = true;
    return Noted::kTooMany;
  }
  if (subscriber.prefixes.insert(prefix).second) ++prefixes_[prefix];
  return prefix.size() <= kLongestTopic ? Noted::kSubscription : Noted::kNothing;
}

void Subscriptions::release(const std::string& prefix) {
  const auto found = prefixes_.find(prefix);
  if (--found->second == 0) prefixes_.erase(found);
}

void Subscriptions::forget(std::uint64_t connection) {
  const std::unique_lock lock(mutex_);
  const auto found = subscribers_.find(connection);
  if (found == subscribers_.end()) return;
  for (const auto& prefix : found->second.prefixes) release(prefix);
  subscribers_.erase(found);
}

bool Subscriptions::wanted(std::string_view topic) const {
  const std::shared_lock lock(mutex_);
  for (std::size_t length = 0; length <= topic.size(); ++length) {
    if (prefixes_.contains(std::string(topic.substr(0, length)))) return true;
  }
  return false;
}

}  // namespace limber::server
