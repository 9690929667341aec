// Health of the server: GetServerInfo, and the questions of monitoring.

#include "server/runtime/process_use.h"
#include "server/service/service.h"
#include "server/wire/session_values.h"

namespace limber::server {
namespace {

void describe(const Latencies& latencies, proto::LatencyHistogram& out) {
  for (const double bound : Latencies::kBounds) out.add_bounds_s(bound);
  for (std::size_t i = 0; i <= Latencies::kBounds.size(); ++i) out.add_counts(latencies.count(i));
  out.set_sum_s(latencies.sum_s());
  out.set_longest_s(latencies.longest_s());
}

void describe(const ProcessUse& use, proto::ProcessUse& out) {
  out.set_resident_bytes(use.resident_bytes);
  out.set_cpu_s(use.cpu_s);
  out.set_open_files(use.open_files);
  out.set_most_open_files(use.most_open_files);
  out.set_threads(use.threads);
}

proto::ServerStatus::Phase encode(Phase phase) {
  switch (phase) {
    case Phase::kStarting:
      return proto::ServerStatus::PHASE_STARTING;
    case Phase::kReady:
      return proto::ServerStatus::PHASE_READY;
    case Phase::kDraining:
      return proto::ServerStatus::PHASE_DRAINING;
  }
  return proto::ServerStatus::PHASE_UNSPECIFIED;
}

}  // namespace

std::vector<std::string> Service::faults() const {
  std::vector<std::string> faults;
  if (const std::string fault = hub_.store ? hub_.store->fault() : ""; !fault.empty())
    faults.push_back("nothing can be stored now: " + fault);
  return faults;
}

std::vector<std::string> Service::not_ready() const {
  std::vector<std::string> reasons = faults();
  switch (hub_.phase.load()) {
    case Phase::kStarting:
      reasons.insert(reasons.begin(), "the server is starting");
      break;
    case Phase::kDraining:
      reasons.insert(reasons.begin(), "the server is draining: it takes no new sessions, and ends");
      break;
    case Phase::kReady:
      break;
  }
  return reasons;
}

void Service::set_limits(const ServiceLimits& limits) {
  hub_.options.limits = limits;
  scenes_.limits = limits;
  sessions_.set_limit(limits.sessions);
  hub_.jobs.set_limit(limits.jobs);
}

void Service::describe_readers(proto::QueueUse& queues) const {
  constexpr std::size_t kMost = 100;
  const Transport& transport = hub_.transport;
  queues.set_stream_bytes(transport.stream_bytes());
  queues.set_stream_limit_bytes(hub_.options.transport.stream_total_bytes);
  queues.set_reader_count(static_cast<std::uint32_t>(transport.follower_count()));
  for (auto& use : transport.follower_uses(kMost)) {
    auto& reader = *queues.add_readers();
    reader.set_client(use.client);
    reader.set_name(std::move(use.name));
    reader.set_topics(use.topics);
    reader.set_waiting_bytes(use.waiting_bytes);
    reader.set_unread_bytes(use.unread_bytes);
    reader.set_sent(use.sent);
    reader.set_left_out(use.left_out);
    reader.set_stalled_s(use.stalled_s);
  }
  for (const auto& use : transport.unread_uses(kMost)) {
    auto& client = *queues.add_unread_clients();
    client.set_client(clients_.number_of(use.client));
    client.set_unread_bytes(use.bytes);
  }
}

void Service::describe_status(proto::ServerStatus& status) const {
  status.set_phase(encode(hub_.phase.load()));
  for (auto& reason : not_ready()) status.add_not_ready(std::move(reason));
  for (auto& fault : faults()) status.add_faults(std::move(fault));
  const auto sessions = sessions_.everything();
  for (const auto& record : sessions.records) *status.add_sessions() = record->use();
  for (const auto& parked : sessions.parked) *status.add_sessions() = use_of(parked.status);
  describe(hub_.counters.acknowledgements, *status.mutable_acknowledgements());
  auto& queues = *status.mutable_queues();
  const auto heavy = heavy_.waiting(), patient = patient_.waiting();
  queues.set_open_requests(hub_.open_requests.total());
  queues.set_unread_bytes(hub_.transport.unread_bytes());
  queues.set_heavy_requests(heavy.requests + patient.requests);
  queues.set_heavy_bytes(heavy.bytes + patient.bytes);
  queues.set_page_bytes(hub_.counters.web_queue_bytes.load());
  describe_readers(queues);
  describe(ProcessUse::now(), *status.mutable_process());
  status.set_running_jobs(hub_.jobs.running());
}

}  // namespace limber::server
