#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/runtime/hub.h"
#include "server/service/service.h"
#include "server/web/gateway.h"

namespace limber::server {

/// A running limberd, without a process around it. Made: bound and answering.
class Server {
 public:
  /// @throws Refusal or Error naming the option
  /// @param pages  the gateway for pages; nothing: none
  explicit Server(ServerOptions options, const MakeKinds& make_kinds = standard_kinds,
                  const std::optional<web::Options>& pages = std::nullopt);
  /// Stops and waits, if run() has not.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] const std::string& request_endpoint() const {
    return hub_.transport.request_endpoint();
  }
  [[nodiscard]] const std::string& stream_endpoint() const {
    return hub_.transport.stream_endpoint();
  }
  /// The addresses for pages, and the tokens that they must show; empty without a gateway.
  [[nodiscard]] const WebEntrance& web() const { return hub_.web; }
  /// Of this run.
  [[nodiscard]] const std::string& instance() const { return hub_.run.instance; }
  /// Timers and signals run here.
  [[nodiscard]] boost::asio::io_context& control() { return hub_.control; }
  [[nodiscard]] const Counters& counters() const { return hub_.counters; }

  /// Any thread, also from signals' handlers of control().
  void request_stop();
  /// As request_stop(), after open requests are acknowledged and stored, ServerOptions::drain_s at
  /// most. New sessions and jobs are refused from now on.
  void request_drain();
  /// In place of those that it was made with, from now on. Any thread.
  void set_limits(const ServiceLimits& limits) { service_.set_limits(limits); }
  void set_drain(double seconds) { hub_.options.drain_s = seconds; }
  /// Calls `done` on the thread of control() once the loops of the server have come round: those of
  /// the sockets, of pages, and of timers. Any thread.
  void ask_loops(std::function<void()> done);
  /// How it does, as a line of the log. Any thread.
  void log_status() const;
  /// Clients in place of those that were allowed. Any thread. @throws Error, and they stay, where
  /// the list that they are from cannot be read again
  void allow(AllowedKeys keys) { service_.allow(std::move(keys)); }

  enum class Ending {
    kClean,  // everything in flight was answered, every task has ended
    kLate,  // the grace was over first: some task still runs, leave the process without destructors
  };
  /// Blocks until a stop is requested, then shuts down within the grace.
  Ending run();
  /// Number of changes of sessions that could not be stored until the end. Behind run().
  [[nodiscard]] std::size_t lost_changes() const { return lost_changes_; }

 private:
  using Clock = std::chrono::steady_clock;
  void open_gateway(web::Options options);
  void republish_status();
  void drain();
  Ending shut_down();
  void refuse_and_cancel();
  [[nodiscard]] bool close_sessions(Clock::time_point deadline);
  [[nodiscard]] bool answer_everybody(Clock::time_point deadline);

  Hub hub_;
  Service service_;
  std::unique_ptr<web::Gateway> gateway_;  // null: none
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> control_work_;
  Deadline status_again_;
  std::thread control_thread_;
  std::mutex mutex_;
  std::condition_variable stop_requested_;
  bool stop_ = false, drain_ = false, ended_ = false;
  std::size_t lost_changes_ = 0;
};

}  // namespace limber::server
