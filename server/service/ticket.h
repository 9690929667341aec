#pragma once

#include <atomic>
#include <exception>
#include <memory>

#include "limber/v1/service.pb.h"
#include "server/transport/transport.h"

namespace limber::server {

namespace proto = limber::v1;

/// One request that must be answered, once. Shared by whoever may answer; the first answer counts.
/// If all let it go unanswered, it answers that the server is going down (its task was dropped), so
/// nobody waits forever.
class Ticket {
 public:
  Ticket(Transport& transport, Counters& counters, std::atomic<std::int64_t>& open, Address address,
         std::uint64_t id);
  ~Ticket();
  Ticket(const Ticket&) = delete;
  Ticket& operator=(const Ticket&) = delete;

  /// Sets version and id. @returns false if it was answered before
  bool answer(proto::Reply reply);
  /// @param prefix  for fields the engine named, e.g. "scene."
  bool refuse(const std::exception& fault, const std::string& prefix = "");
  [[nodiscard]] bool answered() const { return answered_.load(); }

 private:
  Transport& transport_;
  Counters& counters_;
  std::atomic<std::int64_t>& open_;
  Address address_;
  std::uint64_t id_;
  std::atomic<bool> answered_{false};
};

using SharedTicket = std::shared_ptr<Ticket>;

}  // namespace limber::server
