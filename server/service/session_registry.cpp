#include "server/service/session_registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "server/codec/errors.h"

namespace limber::server {
namespace {

void check_name(const std::string& name) {
  const auto allowed = [](unsigned char c) {
    return (std::isalnum(c) != 0 && c < 0x80) || c == '.' || c == '_' || c == '-';
  };
  if (name.size() > 64 || !std::all_of(name.begin(), name.end(), allowed)) {
    throw invalid("session", "a session's name is 1 to 64 of [A-Za-z0-9._-]");
  }
}

Refusal not_found(const std::string& name) {
  return {proto::ERROR_CODE_NOT_FOUND, "session", fmt::format("there is no session '{}'", name)};
}

}  // namespace

std::unique_ptr<SessionRegistry::Reservation> SessionRegistry::reserve(const std::string& wanted) {
  check_name(wanted);
  const std::lock_guard lock(mutex_);
  const auto taken = [&](const std::string& name) {
    return sessions_.count(name) > 0 || reserved_.count(name) > 0;
  };
  if (taken(wanted)) {
    throw Refusal(proto::ERROR_CODE_ALREADY_EXISTS, "session",
                  fmt::format("session '{}' exists", wanted));
  }
  const std::uint64_t open = sessions_.size() + reserved_.size();
  if (open >= limit_) throw limit_exceeded("", "open sessions", limit_, open + 1);
  std::string name = wanted;
  while (name.empty() || taken(name)) name = fmt::format("session-{}", ++last_);
  reserved_.insert(name);
  return std::make_unique<Reservation>(*this, name);
}

void SessionRegistry::release(const std::string& name) {
  const std::lock_guard lock(mutex_);
  reserved_.erase(name);
}

void SessionRegistry::put(std::shared_ptr<SessionRecord> record) {
  const std::lock_guard lock(mutex_);
  const std::string name = record->opened().id;
  reserved_.erase(name);
  sessions_[name] = std::move(record);
}

std::shared_ptr<SessionRecord> SessionRegistry::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(name);
  if (it == sessions_.end()) throw not_found(name);
  return it->second;
}

std::shared_ptr<SessionRecord> SessionRegistry::remove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(name);
  if (it == sessions_.end()) throw not_found(name);
  auto record = it->second;
  sessions_.erase(it);
  return record;
}

std::vector<std::shared_ptr<SessionRecord>> SessionRegistry::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<SessionRecord>> all;
  for (const auto& [name, record] : sessions_) all.push_back(record);
  return all;
}

}  // namespace limber::server
