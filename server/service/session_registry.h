#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/runtime/record.h"

namespace limber::server {

/// The sessions by name. Thread-safe.
///
/// A session whose build failed or was cancelled stays available for questions and for another try,
/// but takes no place. It is removed when a session of its name is opened or, the oldest first,
/// when its place is needed.
class SessionRegistry {
 public:
  SessionRegistry(std::uint32_t limit, const Run& run, RunIds& ids)
      : names_of_run_(run.instance.substr(0, 8)), ids_(ids), limit_(limit) {}

  /// A name taken while its session is being made; given back unless a record is put under it.
  class Reservation {
   public:
    Reservation(SessionRegistry& registry, SessionKey key)
        : registry_(registry), key_(std::move(key)) {}
    ~Reservation() { registry_.release(key_.name); }
    Reservation(const Reservation&) = delete;
    Reservation& operator=(const Reservation&) = delete;
    [[nodiscard]] const SessionKey& key() const { return key_; }

   private:
    SessionRegistry& registry_;
    SessionKey key_;
  };

  /// @param requested  1 to 64 of [A-Za-z0-9._-]; empty: chosen here, never to be reused
  /// Changes nothing that others see: the scene may still be refused.
  /// @throws Refusal INVALID_ARGUMENT, ALREADY_EXISTS, LIMIT_EXCEEDED
  [[nodiscard]] std::unique_ptr<Reservation> reserve(const std::string& requested);
  /// Under the name that was reserved for it.
  /// @returns failed ones that had to go, for the caller to close
  /// One that is parked under that name is it, and is parked no more.
  /// @throws Refusal as reserve() does, where a failed session was taken up again meanwhile
  [[nodiscard]] std::vector<std::shared_ptr<Record>> put(const std::shared_ptr<Record>& record);
  /// Notes that somebody asks for it.
  /// @param reference  NAME or NAME@UID
  /// @throws Refusal NOT_FOUND, also where the name is another session's by now; RESTARTED for a
  /// UID of another run
  [[nodiscard]] std::shared_ptr<Record> find(const std::string& reference) const;
  /// @returns null where there is none
  [[nodiscard]] std::shared_ptr<Record> look_up(const std::string& name) const;
  /// Unless its name is another's by now.
  void remove(const Record& record);
  [[nodiscard]] std::vector<std::shared_ptr<Record>> all() const;

  /// From now on; sessions that are there stay.
  void set_limit(std::uint32_t limit);

  /// A session that is in the store alone: it has its name, but takes no place.
  struct Parked {
    SessionKey key;
    proto::SessionStatus status;
    std::shared_ptr<Attendance> people = nullptr;  // null: of before this run of the server
    /// With the clients that are in it now.
    [[nodiscard]] proto::SessionStatus current_status() const;
  };
  void park(Parked parked);
  /// In the place of its record, at once. @returns false where that is not there any more, or was
  /// found since `unused_since`
  [[nodiscard]] bool park(const std::shared_ptr<Record>& record, proto::SessionStatus status,
                          Record::Clock::time_point unused_since);
  /// @param reference  NAME or NAME@UID. @returns nothing where no such session is parked
  [[nodiscard]] std::optional<Parked> parked(const std::string& reference) const;
  [[nodiscard]] std::vector<Parked> all_parked() const;
  /// Each session once, also while one is being parked or comes back.
  struct Everything {
    std::vector<std::shared_ptr<Record>> records;
    std::vector<Parked> parked;
  };
  [[nodiscard]] Everything everything() const;
  /// It is closed. @returns whether it was parked
  bool forget(const SessionKey& key);

 private:
  struct Entry {
    std::shared_ptr<Record> record;
    std::uint64_t number;  // in the order in which they were put here
  };
  using Sessions = std::map<std::string, Entry>;

  void release(const std::string& name);
  [[nodiscard]] Sessions::iterator oldest_failed();

  const std::string names_of_run_;  // in names that are chosen here
  RunIds& ids_;
  mutable std::mutex mutex_;  // of what follows
  std::uint32_t limit_;
  Sessions sessions_;
  std::map<std::string, Parked> parked_;
  std::set<std::uint64_t> known_;  // of sessions that were ever parked: of another run, and ours
  std::set<std::string> reserved_;
  std::uint64_t last_ = 0, put_ = 0;
};

}  // namespace limber::server
