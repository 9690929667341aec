#include "server/transport/subscriptions.h"

namespace limber::server {

std::optional<std::string> Subscriptions::note(std::string_view message) {
  if (message.empty() || message.size() > kLongestTopic + 1) return std::nullopt;
  const std::string prefix(message.substr(1));
  const std::unique_lock lock(mutex_);
  if (message[0] == 1) {
    if (prefixes_.size() < kMostPrefixes) {
      prefixes_.insert(prefix);
    } else {
      overflow_ = true;
    }
    return prefix;
  }
  if (message[0] == 0) prefixes_.erase(prefix);
  return std::nullopt;
}

bool Subscriptions::wanted(std::string_view topic) const {
  const std::shared_lock lock(mutex_);
  if (overflow_) return true;
  for (std::size_t length = 0; length <= topic.size(); ++length) {
    if (prefixes_.count(std::string(topic.substr(0, length))) > 0) return true;
  }
  return false;
}

}  // namespace limber::server
