#include "server/cli/watchdog.h"

#include <boost/asio/post.hpp>
#include <utility>

#include "server/log/log.h"

namespace limber::server {

Watchdog::Watchdog(boost::asio::io_context& control, std::chrono::microseconds every, Ask ask,
                   std::function<void()> feed)
    : control_(control), every_(every), ask_(std::move(ask)), feed_(std::move(feed)) {
  boost::asio::post(control_, [this] {
    feed_();
    this->ask();
    look();
  });
}

void Watchdog::ask() {
  has_answered_ = false;
  ask_([this] { has_answered_ = true; });
}

void Watchdog::look() {
  again_ = call_after(control_, every_.count(), [this] {
    if (has_answered_) {
      unanswered_ = 0;
      feed_();
      ask();
    } else if (++unanswered_ == 2) {
      log::error("the loops of the server have not come round for {:.1f} s", 2 * every_.count());
    }
    look();
  });
}

}  // namespace limber::server
