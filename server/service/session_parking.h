#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "server/service/session_registry.h"

namespace limber::server {

/// Bounds the memory of all sessions together. Unused ones are parked: they stay in the store
/// alone, and come back at the next request. Servers without a store park none. Thread-safe.
class SessionParking {
 public:
  SessionParking(Hub& hub, SessionRegistry& sessions) : hub_(hub), sessions_(sessions) {}

  /// Memory that is kept for a session until it is in the registry.
  class Room {
   public:
    Room(SessionParking& parking, std::uint64_t bytes) : parking_(parking), bytes_(bytes) {}
    ~Room();
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;

   private:
    SessionParking& parking_;
    const std::uint64_t bytes_;
  };
  /// Parks sessions, those with the oldest requests first, as far as necessary. Waits for the
  /// store.
  /// @throws Refusal LIMIT_EXCEEDED where that is not enough
  [[nodiscard]] std::unique_ptr<Room> make_room(const SessionMemory& memory);

  /// Parks those without requests since ServerOptions::park_after, and releases results that are no
  /// longer fetched in parts.
  void park_idle();

  /// Memory of all sessions that are not parked [bytes].
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  enum class People { kAbsent, kAny };
  /// Those without requests since then, the longest first.
  [[nodiscard]] std::vector<std::shared_ptr<Record>> idle(std::chrono::nanoseconds since,
                                                          People people) const;
  /// Says which sessions are in use, since those that rest were parked before.
  [[nodiscard]] Refusal no_room(std::uint64_t wanted, std::uint64_t bytes) const;
  /// @returns whether it was parked: not where it has work, or cannot be stored now
  bool park(const std::shared_ptr<Record>& record);

  Hub& hub_;
  SessionRegistry& sessions_;
  mutable std::mutex mutex_;    // of what follows
  std::uint64_t reserved_ = 0;  // by Rooms
  std::mutex parking_;          // one thread parks at a time
};

/// To the subscribers of its status topic.
void publish_parked(Hub& hub, const SessionRegistry::Parked& parked);

}  // namespace limber::server
