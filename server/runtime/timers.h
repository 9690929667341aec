#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <utility>

namespace limber::server {

/// A deadline that can be called off. Dropping the handle calls it off too.
class Deadline {
 public:
  explicit Deadline(std::shared_ptr<boost::asio::steady_timer> timer) : timer_(std::move(timer)) {}
  Deadline() = default;
  Deadline(Deadline&&) noexcept = default;
  Deadline& operator=(Deadline&& other) noexcept {
    call_off();
    timer_ = std::move(other.timer_);
    return *this;
  }
  ~Deadline() { call_off(); }
  /// The timer belongs to the control thread: it is cancelled there.
  void call_off() {
    if (auto timer = std::exchange(timer_, nullptr)) {
      boost::asio::post(timer->get_executor(), [timer] { timer->cancel(); });
    }
  }

 private:
  std::shared_ptr<boost::asio::steady_timer> timer_;
};

/// Calls `late` on the control thread after `seconds`, unless called off. Any thread.
template <class Late>
[[nodiscard]] Deadline call_after(boost::asio::io_context& control, double seconds, Late late) {
  using Clock = std::chrono::steady_clock;
  const auto wait =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  auto timer = std::make_shared<boost::asio::steady_timer>(control, wait);
  timer->async_wait(
      [timer, late = std::move(late)](const boost::system::error_code& fault) mutable {
        if (!fault) late();
      });
  return Deadline(std::move(timer));
}

}  // namespace limber::server
