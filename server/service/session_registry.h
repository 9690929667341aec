#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/service/session_record.h"

namespace limber::server {

/// The sessions by name. Thread-safe.
class SessionRegistry {
 public:
  explicit SessionRegistry(std::uint32_t limit) : limit_(limit) {}

  /// A name taken while its session is being made; given back unless a record is put under it.
  class Reservation {
   public:
    Reservation(SessionRegistry& registry, std::string name)
        : registry_(registry), name_(std::move(name)) {}
    ~Reservation() { registry_.release(name_); }
    Reservation(const Reservation&) = delete;
    Reservation& operator=(const Reservation&) = delete;
    [[nodiscard]] const std::string& name() const { return name_; }

   private:
    SessionRegistry& registry_;
    std::string name_;
  };

  /// @param wanted  1 to 64 of [A-Za-z0-9._-]; empty: chosen here
  /// @throws Refusal INVALID_ARGUMENT, ALREADY_EXISTS, LIMIT_EXCEEDED
  [[nodiscard]] std::unique_ptr<Reservation> reserve(const std::string& wanted);
  void put(std::shared_ptr<SessionRecord> record);
  /// @throws Refusal NOT_FOUND
  [[nodiscard]] std::shared_ptr<SessionRecord> find(const std::string& name) const;
  std::shared_ptr<SessionRecord> remove(const std::string& name);  // throws as find() does
  [[nodiscard]] std::vector<std::shared_ptr<SessionRecord>> all() const;

 private:
  void release(const std::string& name);

  const std::uint32_t limit_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<SessionRecord>> sessions_;
  std::set<std::string> reserved_;
  std::uint64_t last_ = 0;
};

}  // namespace limber::server
