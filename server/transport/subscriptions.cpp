#include "server/transport/subscriptions.h"

#include <mutex>
#include <utility>

namespace limber::server {
namespace {

/// @param prefixes  a set or map of them
template <class Prefixes>
bool has_prefix_of(std::string_view topic, const Prefixes& prefixes) {
  for (std::size_t length = 0; length <= topic.size(); ++length) {
    if (prefixes.contains(std::string(topic.substr(0, length)))) return true;
  }
  return false;
}

}  // namespace

Subscriptions::Noted Subscriptions::note(std::uint64_t connection, std::string_view message,
                                         std::uint64_t group) {
  if (message.empty() || (message[0] != 0 && message[0] != 1)) return Noted::kNothing;
  const std::string prefix(message.substr(1));
  const std::unique_lock lock(mutex_);
  if (message[0] == 0) {  // libzmq reports it without a number if its connection has ended
    const auto found = subscribers_.find(connection);
    if (found != subscribers_.end() && found->second.prefixes.erase(prefix) > 0) release(prefix);
    return Noted::kNothing;
  }
  Subscriber& subscriber = subscribers_[connection];
  subscriber.group = group != 0 ? group : connection;
  if (subscriber.is_cut_off) return Noted::kNothing;
  const bool is_new_of_all = !prefixes_.contains(prefix);
  if (!subscriber.prefixes.contains(prefix) &&
      (subscriber.prefixes.size() >= kMaxOfOne || (is_new_of_all && !make_room_for(connection)))) {
    subscriber.is_cut_off = true;
    return Noted::kTooMany;
  }
  if (subscriber.prefixes.insert(prefix).second) ++prefixes_[prefix];
  return prefix.size() <= kLongestTopic ? Noted::kSubscription : Noted::kNothing;
}

/// @returns false where none has more than this one
bool Subscriptions::make_room_for(std::uint64_t connection) {
  while (prefixes_.size() >= kMaxPrefixes) {
    const std::uint64_t most = greediest(connection);
    if (most == connection) return false;
    Subscriber& displaced = subscribers_.at(most);
    for (const auto& prefix : displaced.prefixes) release(prefix);
    displaced.prefixes.clear();
    displaced.is_cut_off = true;
    displaced_.push_back(most);
  }
  return true;
}

/// The largest subscriber of the largest group; if several are equal, the given one or the oldest.
std::uint64_t Subscriptions::greediest(std::uint64_t of_equals) const {
  std::unordered_map<std::uint64_t, std::size_t> of_groups;
  for (const auto& [connection, subscriber] : subscribers_)
    of_groups[subscriber.group] += subscriber.prefixes.size();
  const auto count_of = [&](const Subscriber& subscriber) {
    return std::pair{of_groups.at(subscriber.group), subscriber.prefixes.size()};
  };
  std::uint64_t found = of_equals;
  auto most = count_of(subscribers_.at(of_equals));
  for (const auto& [connection, subscriber] : subscribers_) {
    const auto count = count_of(subscriber);
    if (count < most || (count == most && (found == of_equals || connection > found))) continue;
    found = connection;
    most = count;
  }
  return found;
}

std::vector<std::uint64_t> Subscriptions::take_displaced() {
  const std::unique_lock lock(mutex_);
  return std::exchange(displaced_, {});
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

bool Subscriptions::has_subscriber(std::string_view topic) const {
  const std::shared_lock lock(mutex_);
  return has_prefix_of(topic, prefixes_);
}

bool Subscriptions::is_subscribed(std::uint64_t connection, std::string_view topic) const {
  const std::shared_lock lock(mutex_);
  const auto found = subscribers_.find(connection);
  return found != subscribers_.end() && has_prefix_of(topic, found->second.prefixes);
}

}  // namespace limber::server
