#pragma once

#include <boost/asio/io_context.hpp>
#include <mutex>
#include <string>
#include <vector>

#include "server/runtime/ticket.h"
#include "server/runtime/timers.h"

namespace limber::server {

/// Clients that wait for a result of one session. Resolved where results are published: nothing is
/// polled. Thread-safe.
class ResultWaiters {
 public:
  enum class Until { kFirst, kFinal, kChecked };
  /// Whether more will be found out about a final result.
  enum class Check { kPending, kDone };

  explicit ResultWaiters(boost::asio::io_context& control) : control_(control) {}

  /// Answers at once if the session's newest results will do.
  void wait(std::uint64_t revision, Until until, double timeout_s, const SharedTicket& ticket);
  /// Whether a final result is still to be stored: clients that wait for it wait for that, too.
  enum class Storing { kPending, kDone };
  /// @param check, storing  of a final result; of others they mean nothing. One whose storing was
  /// pending is noted again after it is stored, maybe later than newer ones
  void note(const std::shared_ptr<const proto::ResultInfo>& result, Check check,
            Storing storing = Storing::kDone);
  /// All waiting clients get this error; with `Later::kRefuse` also later ones.
  enum class Later { kAccept, kRefuse };
  void refuse_all(const std::exception& fault, Later later);
  /// The client has disconnected: its requests need no answers.
  void abandon(const std::string& client);
  /// After a failed build that is tried again.
  void accept();
  [[nodiscard]] std::size_t size() const;

 private:
  struct Waiter {
    std::uint64_t revision;
    Until until;
    SharedTicket ticket;
    Deadline deadline;
  };
  struct Noted {
    std::shared_ptr<const proto::ResultInfo> result;  // null: none yet
    Check check = Check::kPending;
    Storing storing = Storing::kDone;
  };
  [[nodiscard]] static bool answers(const Noted& noted, std::uint64_t revision, Until until);
  void answer(Ticket& ticket, const proto::ResultInfo& result) const;
  void late(const SharedTicket& ticket, double timeout_s);

  boost::asio::io_context& control_;
  mutable std::mutex mutex_;
  Noted newest_, converged_, checked_;
  std::vector<Waiter> waiters_;
  proto::Error refusal_;  // for new clients, if it has a code
};

}  // namespace limber::server
