#include "server/runtime/stored_replies.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "server/runtime/ticket.h"

namespace limber::server {
namespace {

constexpr std::size_t kHashedWhole = 4 << 20, kSlice = 4 << 10, kStride = 64 << 10;
constexpr std::size_t kEntryBytes = 512;  // of an entry with its keys, roughly

std::size_t mix(std::size_t hash, std::size_t other) {
  return hash ^ (other + 0x9e3779b97f4a7c15ull + (hash << 6) + (hash >> 2));
}

}  // namespace

std::uint64_t content_hash(std::string_view bytes) {
  const std::hash<std::string_view> hash;
  if (bytes.size() <= kHashedWhole) return hash(bytes);
  std::size_t all = bytes.size();
  for (std::size_t at = 0; at < bytes.size(); at += kStride)
    all = mix(all, hash(bytes.substr(at, kSlice)));
  return mix(all, hash(bytes.substr(bytes.size() - kSlice)));
}

StoredReplies::StoredReplies() : StoredReplies(Limits{}) {}

StoredReplies::Finding StoredReplies::begin(const RequestKey& key, std::uint64_t hash,
                                            const std::shared_ptr<Ticket>& ticket,
                                            Clock::time_point now) {
  std::shared_ptr<Ticket> superseded;  // released without the lock: a ticket's end comes back here
  const std::lock_guard lock(mutex_);
  drop_expired(now);
  auto& entries = clients_[key.client].entries;
  const auto [it, is_new] = entries.try_emplace(key.id);
  Entry& entry = it->second;
  if (is_new) {
    entry.hash = hash;
    entry.connection = ticket->client();
    return {Verdict::kNew, {}};
  }
  if (entry.hash != hash) return {Verdict::kDifferent, {}};
  if (entry.is_too_large) return {Verdict::kTooLarge, {}};
  if (entry.is_answered) return {Verdict::kAnswered, entry.reply};
  // One of the first connection may have been overtaken by one of the newest, which still waits.
  if (ticket->client() == entry.connection) {
    ticket->absorb();
    return {Verdict::kRunning, {}};
  }
  superseded = std::exchange(entry.repeated, ticket);
  if (superseded) superseded->absorb();
  return {Verdict::kRunning, {}};
}

std::shared_ptr<Ticket> StoredReplies::answer(const RequestKey& key, const std::string& reply,
                                              Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto client = clients_.find(key.client);
  if (client == clients_.end()) return nullptr;
  const auto it = client->second.entries.find(key.id);
  if (it == client->second.entries.end() || it->second.is_answered) return nullptr;
  Entry& entry = it->second;
  auto repeated = std::exchange(entry.repeated, nullptr);
  entry.is_answered = true;
  entry.is_too_large = reply.size() + kEntryBytes > limits_.client_bytes;
  if (!entry.is_too_large) entry.reply = reply;
  entry.answered_at = now;
  entry.place = oldest_first_.insert(oldest_first_.end(), key);
  client->second.answered.push_back(key.id);
  const std::size_t bytes = entry.reply.size() + kEntryBytes;
  client->second.bytes += bytes;
  bytes_ += bytes;
  while (client->second.answered.size() > 1 &&
         (client->second.answered.size() > limits_.client_replies ||
          client->second.bytes > limits_.client_bytes))
    drop_oldest_of(key.client);
  while (bytes_ > limits_.total_bytes && !oldest_first_.empty())
    drop_oldest_of(oldest_first_.front().client);
  drop_expired(now);
  return repeated;
}

void StoredReplies::recall(const RequestKey& key, std::uint64_t hash, std::string reply,
                           Clock::time_point now) {
  {
    const std::lock_guard lock(mutex_);
    const auto [it, is_new] = clients_[key.client].entries.try_emplace(key.id);
    if (!is_new) return;
    it->second.hash = hash;
  }
  (void)answer(key, reply, now);  // not repeated yet
}

std::shared_ptr<Ticket> StoredReplies::abandon(const RequestKey& key) {
  const std::lock_guard lock(mutex_);
  const auto client = clients_.find(key.client);
  if (client == clients_.end()) return nullptr;
  const auto it = client->second.entries.find(key.id);
  if (it == client->second.entries.end() || it->second.is_answered) return nullptr;
  if (auto heir = std::exchange(it->second.repeated, nullptr)) {
    it->second.connection = heir->client();
    return heir;
  }
  client->second.entries.erase(it);
  if (client->second.entries.empty()) clients_.erase(client);
  return nullptr;
}

std::shared_ptr<Ticket> StoredReplies::forget(const RequestKey& key) {
  const std::lock_guard lock(mutex_);
  const auto client = clients_.find(key.client);
  if (client == clients_.end()) return nullptr;
  const auto it = client->second.entries.find(key.id);
  if (it == client->second.entries.end() || it->second.is_answered) return nullptr;
  auto repeated = std::exchange(it->second.repeated, nullptr);
  client->second.entries.erase(it);
  if (client->second.entries.empty()) clients_.erase(client);
  return repeated;
}

/// Called with the lock, for a client that has some.
void StoredReplies::drop_oldest_of(const std::string& name) {
  const auto client = clients_.find(name);
  const auto it = client->second.entries.find(client->second.answered.front());
  const std::size_t bytes = it->second.reply.size() + kEntryBytes;
  client->second.bytes -= bytes;
  bytes_ -= bytes;
  client->second.answered.pop_front();
  const auto place = it->second.place;
  client->second.entries.erase(it);
  if (client->second.entries.empty()) clients_.erase(client);
  oldest_first_.erase(place);  // last: `name` may be in it
}

/// Called with the lock.
void StoredReplies::drop_expired(Clock::time_point now) {
  while (!oldest_first_.empty()) {
    const RequestKey& oldest = oldest_first_.front();
    if (now - clients_.at(oldest.client).entries.at(oldest.id).answered_at < limits_.age) return;
    drop_oldest_of(oldest.client);
  }
}

std::size_t StoredReplies::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::size_t StoredReplies::size() const {
  const std::lock_guard lock(mutex_);
  return oldest_first_.size();
}

}  // namespace limber::server
