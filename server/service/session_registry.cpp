#include "server/service/session_registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "server/wire/abbreviate.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

void check_name(const std::string& name) {
  const auto allowed = [](unsigned char c) {
    return (std::isalnum(c) != 0 && c < 0x80) || c == '.' || c == '_' || c == '-';
  };
  if (name.size() > 64 || name == "." || name == ".." ||
      !std::all_of(name.begin(), name.end(), allowed)) {
    throw invalid("session", "a session's name is 1 to 64 of [A-Za-z0-9._-], not . or ..");
  }
}

Refusal not_found(const std::string& name) {
  return {proto::ERROR_CODE_NOT_FOUND, "session",
          fmt::format("there is no session '{}'", abbreviate(name))};
}

Refusal exists(const std::string& name) {
  return {proto::ERROR_CODE_ALREADY_EXISTS, "session", fmt::format("session '{}' exists", name)};
}

}  // namespace

proto::SessionStatus SessionRegistry::Parked::current_status() const {
  proto::SessionStatus now = status;
  now.clear_clients();
  now.clear_revisions();
  if (people) people->describe(now, Attendance::Clock::now());
  return now;
}

std::unique_ptr<SessionRegistry::Reservation> SessionRegistry::reserve(
    const std::string& requested) {
  check_name(requested);
  const std::lock_guard lock(mutex_);
  const auto known = sessions_.find(requested);
  if (reserved_.count(requested) > 0 || parked_.count(requested) > 0 ||
      (known != sessions_.end() && !known->second.record->failed()))
    throw exists(requested);
  std::uint64_t open = reserved_.size();
  for (const auto& [name, entry] : sessions_) open += entry.record->failed() ? 0 : 1;
  if (open >= limit_) throw limit_exceeded("", "open sessions", limit_, open + 1);
  std::string name = requested;
  while (name.empty() || (name != requested && (sessions_.count(name) + reserved_.count(name) +
                                                parked_.count(name)) > 0))
    name = fmt::format("session-{}-{}", names_of_run_, ++last_);
  reserved_.insert(name);
  return std::make_unique<Reservation>(*this, SessionKey{name, ids_.next()});
}

void SessionRegistry::release(const std::string& name) {
  const std::lock_guard lock(mutex_);
  reserved_.erase(name);
}

SessionRegistry::Sessions::iterator SessionRegistry::oldest_failed() {
  auto oldest = sessions_.end();
  for (auto it = sessions_.begin(); it != sessions_.end(); ++it) {
    if (it->second.record->failed() &&
        (oldest == sessions_.end() || it->second.number < oldest->second.number))
      oldest = it;
  }
  return oldest;
}

std::vector<std::shared_ptr<Record>> SessionRegistry::put(const std::shared_ptr<Record>& record) {
  const std::lock_guard lock(mutex_);
  const std::string name = record->id();
  std::vector<std::shared_ptr<Record>> gone;
  const auto go = [&](Sessions::iterator it) {
    gone.push_back(std::move(it->second.record));
    sessions_.erase(it);
  };
  if (const auto same = sessions_.find(name); same != sessions_.end()) {
    if (!same->second.record->failed()) throw exists(name);
    go(same);
  }
  // All are counted here, so that no more than the limit are ever there, whichever of the failed
  // ones is taken up again.
  while (sessions_.size() >= limit_) {
    const auto oldest = oldest_failed();
    if (oldest == sessions_.end())
      throw limit_exceeded("", "open sessions", limit_, sessions_.size() + 1);
    go(oldest);
  }
  reserved_.erase(name);
  parked_.erase(name);
  sessions_.emplace(name, Entry{record, ++put_});
  return gone;
}

std::shared_ptr<Record> SessionRegistry::find(const std::string& reference) const {
  const SessionKey requested = SessionKey::parse(reference);
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(requested.name);
  const bool is_it = it != sessions_.end() && it->second.record->key().uid == requested.uid;
  // A session that came back has the uid that it was given by another run.
  if (!is_it && !known_.contains(requested.uid) && ids_.is_of_another_run(requested.uid))
    throw restarted("session", fmt::format("session '{}'", requested.name));
  if (it == sessions_.end()) throw not_found(requested.name);
  if (requested.uid != 0 && it->second.record->key().uid != requested.uid) {
    throw Refusal(proto::ERROR_CODE_NOT_FOUND, "session",
                  fmt::format("session '{}' was closed; another one has its name", requested.name));
  }
  it->second.record->touch();
  return it->second.record;
}

std::shared_ptr<Record> SessionRegistry::look_up(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(name);
  return it == sessions_.end() ? nullptr : it->second.record;
}

void SessionRegistry::remove(const Record& record) {
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(record.id());
  if (it != sessions_.end() && it->second.record.get() == &record) sessions_.erase(it);
}

void SessionRegistry::set_limit(std::uint32_t limit) {
  const std::lock_guard lock(mutex_);
  limit_ = limit;
}

void SessionRegistry::park(Parked parked) {
  const std::lock_guard lock(mutex_);
  const std::string name = parked.key.name;
  known_.insert(parked.key.uid);
  parked_.insert_or_assign(name, std::move(parked));
}

bool SessionRegistry::park(const std::shared_ptr<Record>& record, proto::SessionStatus status,
                           Record::Clock::time_point unused_since) {
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(record->id());
  if (it == sessions_.end() || it->second.record != record || record->used_at() > unused_since)
    return false;
  sessions_.erase(it);
  known_.insert(record->key().uid);
  parked_.insert_or_assign(record->id(),
                           Parked{record->key(), std::move(status), record->shared_attendance()});
  return true;
}

std::optional<SessionRegistry::Parked> SessionRegistry::parked(const std::string& reference) const {
  const std::string name = reference.substr(0, reference.find('@'));
  const std::lock_guard lock(mutex_);
  const auto it = parked_.find(name);
  if (it == parked_.end()) return std::nullopt;
  if (name != reference && it->second.key.reference() != reference) return std::nullopt;
  return it->second;
}

std::vector<SessionRegistry::Parked> SessionRegistry::all_parked() const {
  const std::lock_guard lock(mutex_);
  std::vector<Parked> all;
  for (const auto& [name, parked] : parked_) all.push_back(parked);
  return all;
}

SessionRegistry::Everything SessionRegistry::everything() const {
  const std::lock_guard lock(mutex_);
  Everything found;
  for (const auto& [name, entry] : sessions_) found.records.push_back(entry.record);
  for (const auto& [name, parked] : parked_) found.parked.push_back(parked);
  return found;
}

bool SessionRegistry::forget(const SessionKey& key) {
  const std::lock_guard lock(mutex_);
  const auto it = parked_.find(key.name);
  if (it == parked_.end() || it->second.key.uid != key.uid) return false;
  parked_.erase(it);
  return true;
}

std::vector<std::shared_ptr<Record>> SessionRegistry::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Record>> all;
  for (const auto& [name, entry] : sessions_) all.push_back(entry.record);
  return all;
}

}  // namespace limber::server
