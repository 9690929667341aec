#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <string>

#include "limber/v1/service.pb.h"
#include "server/service/open_requests.h"
#include "server/transport/transport.h"

namespace limber::server {

namespace proto = limber::v1;

/// One request that must be answered, once. Shared by whoever may answer; the first answer counts.
/// If all let it go unanswered, it answers that the server is going down (its task was dropped), so
/// nobody waits forever.
class Ticket {
 public:
  Ticket(Transport& transport, Counters& counters, OpenRequests& open, Address address,
         std::uint64_t id);
  ~Ticket();
  Ticket(const Ticket&) = delete;
  Ticket& operator=(const Ticket&) = delete;

  /// Sets version and id. @returns false if it was answered before
  bool answer(proto::Reply reply);
  /// @param prefix  for fields the engine named, e.g. "scene."
  bool refuse(const std::exception& fault, const std::string& prefix = "");
  /// For a client that is gone: nothing is sent.
  void abandon();
  [[nodiscard]] const std::string& client() const { return client_; }
  [[nodiscard]] bool answered() const { return answered_.load(); }

 private:
  Transport& transport_;
  Counters& counters_;
  OpenRequests& open_;
  const std::string client_;  // its routing id
  Address address_;
  std::uint64_t id_;
  std::atomic<bool> answered_{false};
};

using SharedTicket = std::shared_ptr<Ticket>;

}  // namespace limber::server
