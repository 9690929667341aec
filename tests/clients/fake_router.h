#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "limber/v1/service.pb.h"
#include "limber/v1/stream.pb.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {

/// A ROUTER and an XPUB in a thread: answers each request with the replies a test's handler makes
/// of it.
class FakeRouter {
 public:
  using Handler = std::function<std::vector<std::string>(const v1::Request&)>;

  explicit FakeRouter(Handler handler) : handler_(std::move(handler)) {
    router_.set(zmq::sockopt::linger, 0);
    router_.bind(requests());
    publisher_.set(zmq::sockopt::linger, 0);
    publisher_.bind(stream());
    thread_ = std::thread([this] { run(); });
  }
  ~FakeRouter() {
    stop_ = true;
    thread_.join();
    router_.close();
    publisher_.close();
  }
  FakeRouter(const FakeRouter&) = delete;
  FakeRouter& operator=(const FakeRouter&) = delete;

  [[nodiscard]] std::string requests() const {
    return "ipc://" + (folder_.path() / "requests").string();
  }
  [[nodiscard]] std::string stream() const {
    return "ipc://" + (folder_.path() / "stream").string();
  }
  [[nodiscard]] int received() const { return received_; }
  [[nodiscard]] int subscriptions() const { return subscriptions_; }

  void publish(const std::string& topic, const std::string& bytes) {
    const std::lock_guard lock(mutex_);
    publisher_.send(zmq::buffer(topic), zmq::send_flags::sndmore);
    publisher_.send(zmq::buffer(bytes), zmq::send_flags::none);
  }

 private:
  void run() {
    while (!stop_) {
      {
        const std::lock_guard lock(mutex_);
        zmq::message_t subscription;
        while (publisher_.recv(subscription, zmq::recv_flags::dontwait)) ++subscriptions_;
      }
      zmq::pollitem_t item{router_.handle(), 0, ZMQ_POLLIN, 0};
      if (zmq::poll(&item, 1, std::chrono::milliseconds{10}) == 0) continue;
      zmq::message_t sender;
      zmq::message_t body;
      if (!router_.recv(sender) || !router_.recv(body)) continue;
      v1::Request request;
      request.ParseFromArray(body.data(), static_cast<int>(body.size()));
      ++received_;
      for (const auto& reply : handler_(request)) {
        router_.send(zmq::buffer(sender.data(), sender.size()), zmq::send_flags::sndmore);
        router_.send(zmq::buffer(reply), zmq::send_flags::none);
      }
    }
  }

  Handler handler_;
  limber::TemporaryFolder folder_;
  zmq::context_t context_;
  zmq::socket_t router_{context_, ZMQ_ROUTER};
  zmq::socket_t publisher_{context_, ZMQ_XPUB};
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
  std::atomic<int> received_{0};
  std::atomic<int> subscriptions_{0};
  std::thread thread_;
};

}  // namespace limber::client
