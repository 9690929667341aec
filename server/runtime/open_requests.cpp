#include "server/runtime/open_requests.h"

#include <algorithm>

namespace limber::server {

void OpenRequests::begin(const std::string& client) {
  const std::lock_guard lock(mutex_);
  ++by_client_[client];
  total_.fetch_add(1);
}

void OpenRequests::answered(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = by_client_.find(client);
  if (found != by_client_.end() && --found->second == 0) by_client_.erase(found);
}

std::uint64_t OpenRequests::total() const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, total_.load()));
}

unsigned OpenRequests::begin_lasting() {
  const unsigned epoch = epoch_.load();
  lasting_.at(epoch).fetch_add(1);
  return epoch;
}

std::uint64_t OpenRequests::lasting_of(unsigned epoch) const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, lasting_.at(epoch).load()));
}

std::uint64_t OpenRequests::of(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  const auto found = by_client_.find(client);
  return found == by_client_.end() ? 0 : found->second;
}

}  // namespace limber::server
