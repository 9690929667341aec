#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"
#include "limber/v1/stored.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// A client as others see it.
struct ClientIdentity {
  std::uint64_t number = 0;
  std::string name;
};

/// The clients in one session, and the authors of its newest revisions. Thread-safe.
class Attendance {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMaxClients = 100;
  static constexpr std::size_t kMaxRevisions = 16;  // runs of revisions of one client and kind

  explicit Attendance(Clock::time_point opened) : opened_(opened) {}

  enum class Joined { kNew, kAgain, kFull };
  /// One that is there already takes its new name, if it has one.
  Joined join(const ClientIdentity& client, Clock::time_point now);
  /// @returns whether it was there
  bool leave(std::uint64_t number);
  [[nodiscard]] bool is_empty() const;
  /// @param edits  members of proto::Edit, or of proto::Request; once each
  void note_revision(const ClientIdentity& client, std::uint64_t revision,
                     std::vector<std::string> edits, Clock::time_point now);

  /// The runs of revisions that this was told of, the newest first.
  /// @param now_ms  the same time [ms since 1970]
  [[nodiscard]] std::vector<proto::StoredMaker> makers(Clock::time_point now,
                                                       std::uint64_t now_ms) const;
  /// The same again, before anything is noted.
  void recall(const google::protobuf::RepeatedPtrField<proto::StoredMaker>& makers,
              Clock::time_point now, std::uint64_t now_ms);
  void describe(proto::SessionStatus& status, Clock::time_point now) const;
  void describe(proto::JoinSessionResponse& response, Clock::time_point now) const;

 private:
  struct Present {
    ClientIdentity client;
    Clock::time_point since;
    std::uint64_t last_revision = 0;
  };
  struct Made {
    std::uint64_t revision, first;
    ClientIdentity client;
    std::vector<std::string> edits;
    Clock::time_point at;
  };
  [[nodiscard]] Present* find(std::uint64_t number);  // with the lock
  template <class Message>
  void add_people(Message& message, Clock::time_point now) const;

  const Clock::time_point opened_;
  mutable std::mutex mutex_;      // of what follows
  std::vector<Present> present_;  // the longest first
  std::deque<Made> made_;         // the newest first
};

}  // namespace limber::server
