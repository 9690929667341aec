#include "server/service/server.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <future>

#include "server/log/log.h"
#include "server/runtime/process_use.h"
#include "server/service/metrics.h"
#include "server/wire/errors.h"

namespace limber::server {

Server::Server(ServerOptions options, const MakeKinds& make_kinds,
               const std::optional<web::Options>& pages)
    : hub_(std::move(options)),
      service_(hub_, make_kinds(hub_.options), [this] { request_stop(); }),
      control_work_(boost::asio::make_work_guard(hub_.control)) {
  if (pages) open_gateway(*pages);
  republish_status();
  control_thread_ = std::thread([this] { hub_.control.run(); });
  hub_.transport.start(
      {[this](Address address, zmq::message_t payload) {
         service_.handle(std::move(address), std::move(payload));
       },
       [this](const std::string& prefix, Has has) { service_.subscribed(prefix, has); },
       [this](const Address& address, const UnreadReplies::Excess& excess) {
         return service_.overflow_reply(address, excess);
       },
       [this](const std::string& client) { service_.gone(client); },
       [this](const std::string& client) { service_.disconnected(client); }});
  hub_.phase.store(Phase::kReady);
  if (gateway_) gateway_->start();
}

void Server::open_gateway(web::Options options) {
  options.message_bytes = hub_.options.transport.message_bytes;
  web::Probes probes;
  probes.not_ready = [this] { return service_.not_ready(); };
  probes.metrics = [this] {
    proto::GetServerInfoResponse info = service_.info();
    service_.describe_status(*info.mutable_status());
    return metrics_text(info);
  };
  gateway_ = std::make_unique<web::Gateway>(options, hub_.transport, hub_.counters, probes);
  const web::Tokens& tokens = gateway_->tokens();
  hub_.web = {gateway_->url(), tokens.of(Role::kAdminister), tokens.all()};
}

Server::~Server() {
  if (!ended_) {
    request_stop();
    run();
  }
}

void Server::republish_status() {
  const std::chrono::duration<double> interval = hub_.options.status_interval;
  status_again_ = call_after(hub_.control, interval.count(), [this] {
    for (const auto& record : service_.sessions().all()) record->publish_status();
    service_.publish_all_parked();
    service_.park_idle();
    republish_status();
  });
}

void Server::request_stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stop_requested_.notify_all();
}

void Server::request_drain() {
  {
    const std::lock_guard lock(mutex_);
    drain_ = true;
  }
  stop_requested_.notify_all();
}

void Server::ask_loops(std::function<void()> done) {
  auto then = [this, done = std::move(done)]() mutable {
    boost::asio::post(hub_.control, std::move(done));
  };
  hub_.transport.call([this, then = std::move(then)]() mutable {
    if (!gateway_) return then();
    gateway_->call(std::move(then));
  });
}

void Server::log_status() const {
  const proto::GetServerInfoResponse info = service_.info();
  const ProcessUse use = ProcessUse::now();
  const auto parked = info.has_store() ? info.store().parked() : 0;
  std::string remarks;
  for (const std::string& reason : service_.not_ready()) remarks += "; " + reason;
  if (!info.store().warning().empty()) remarks += "; " + info.store().warning();
  log::info(
      "status: up {:.0f} s; sessions: {} in memory, {} parked; jobs: {}; requests: {} open of {}, "
      "errors: {}; {:.0f} MB resident, {:.1f} s of processor time, open files: {}{}",
      info.uptime_s(), service_.sessions().all().size(), parked, hub_.jobs.running(),
      hub_.open_requests.total(), hub_.counters.requests.load(), hub_.counters.errors.load(),
      static_cast<double>(use.resident_bytes) * 1e-6, use.cpu_s, use.open_files, remarks);
}

Server::Ending Server::run() {
  {
    std::unique_lock lock(mutex_);
    stop_requested_.wait(lock, [this] { return stop_ || drain_; });
  }
  drain();
  const Ending ending = shut_down();
  ended_ = true;
  return ending;
}

/// Changes are acknowledged, and so written: first open requests, then those that came meanwhile,
/// while no more are accepted. Clients that wait for results do not delay it.
void Server::drain() {
  const auto begin = Clock::now();
  std::unique_lock lock(mutex_);
  if (stop_) return;
  hub_.is_handed_over.store(hub_.store != nullptr);  // first: refusals of the phase say so
  hub_.phase.store(Phase::kDraining);
  log::info("draining: no new sessions, at most {} s", static_cast<double>(hub_.options.drain_s));
  const std::chrono::duration<double> most(hub_.options.drain_s);
  const auto wait_while = [&](auto is_busy) {
    while (!stop_ && is_busy() && Clock::now() - begin < most)
      stop_requested_.wait_for(lock, std::chrono::milliseconds(2));
  };
  hub_.open_requests.begin_epoch();
  wait_while([this] { return hub_.open_requests.old_lasting() > 0; });
  hub_.stopping.store(true);
  wait_while([this] { return hub_.open_requests.lasting() > 0; });
  if (stop_) hub_.is_handed_over.store(false);  // it is to end, even if a client began the drain
  lock.unlock();
  const std::uint64_t left = hub_.open_requests.lasting();
  const std::chrono::duration<double> took = Clock::now() - begin;
  if (left > 0) {
    log::warn("drained for {:.3f} s: {} requests are not acknowledged", took.count(), left);
  } else {
    log::info("drained after {:.3f} s", took.count());
  }
}

/// Waiting clients get the true reason before the cancellations would give another.
void Server::refuse_and_cancel() {
  service_.refuse_waiting(hub_.going_down());
  const auto records = service_.sessions().all();
  for (const auto& record : records) {
    record->waiters().refuse_all(hub_.going_down(), ResultWaiters::Later::kRefuse);
  }
  hub_.jobs.shut_down(hub_.going_down());
  for (const auto& record : records) {
    try {
      record->stop_work();
    } catch (const std::exception&) {  // closed meanwhile, or not yet there
    }
    record->end(hub_.going_down());
  }
}

/// Sessions stop where their tasks look at the cancellation; those that do not until the deadline
/// are left behind.
bool Server::close_sessions(Clock::time_point deadline) {
  auto records = service_.sessions().all();
  auto closed = std::make_shared<std::promise<void>>();
  auto done = closed->get_future();
  std::thread closer([records = std::move(records), closed] {
    for (const auto& record : records) {
      try {
        record->close_session();
      } catch (const std::exception& fault) {
        log::debug("closing {}: {}", record->id(), fault.what());
      }
    }
    closed->set_value();
  });
  if (done.wait_until(deadline) == std::future_status::ready) {
    closer.join();
    return true;
  }
  closer.detach();
  return false;
}

bool Server::answer_everybody(Clock::time_point deadline) {
  // New ones keep coming, and are refused: that there was none for a moment is enough.
  while (hub_.open_requests.total() > 0) {
    if (Clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

Server::Ending Server::shut_down() {
  const auto begin = Clock::now();
  const auto deadline = begin + hub_.options.grace;
  log::info("shutting down");
  hub_.phase.store(Phase::kDraining);
  hub_.stopping.store(true);
  bool clean = true;
  // Twice: a session that was being opened appears only with the answer to its request.
  for (int pass = 0; pass < 2; ++pass) {
    refuse_and_cancel();
    clean = close_sessions(deadline) && answer_everybody(deadline) && clean;
  }
  hub_.transport.stop();
  if (gateway_) gateway_->stop();
  control_work_.reset();
  hub_.control.stop();
  control_thread_.join();
  if (clean) {
    hub_.solve_pool.join();
    hub_.refine_pool.join();
    hub_.session_pool.join();
    hub_.request_pool.join();
    hub_.patient_request_pool.join();
  }
  // Not by its destructor, which does not come where some task is left behind.
  if (hub_.store) lost_changes_ = hub_.store->end();
  const std::chrono::duration<double> took = Clock::now() - begin;
  if (clean) {
    log::info("stopped after {:.3f} s", took.count());
  } else {
    log::warn("stopped after {:.3f} s with work still running", took.count());
  }
  return clean ? Ending::kClean : Ending::kLate;
}

}  // namespace limber::server
