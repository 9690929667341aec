#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>

#include "server/runtime/timers.h"

namespace limber::server {

/// Feeds the service manager's watchdog as long as the loops of the server come round: a loop that
/// hangs leaves it unfed. Made, and ended, while nothing runs on `control` or on its thread.
class Watchdog {
 public:
  /// Asks the loops, and has `done` called on the thread of `control` once they have come round.
  using Ask = std::function<void(std::function<void()> done)>;

  /// @param every  how often it looks; it feeds no oftener
  Watchdog(boost::asio::io_context& control, std::chrono::microseconds every, Ask ask,
           std::function<void()> feed);
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  void look();
  void ask();

  boost::asio::io_context& control_;
  const std::chrono::duration<double> every_;
  const Ask ask_;
  const std::function<void()> feed_;
  bool has_answered_ = false;
  int unanswered_ = 0;  // looks in a row
  Deadline again_;
};

}  // namespace limber::server
