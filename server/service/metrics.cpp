#include "server/service/metrics.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <limits>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

namespace limber::server {
namespace {

namespace proto = limber::v1;
using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

/// Families in the order in which they are added.
class Families {
 public:
  MetricFamily& family(const char* name, MetricType type, const char* help) {
    const bool is_common = std::string_view(name).starts_with("process_");
    families_.push_back({is_common ? name : std::string("limber_") + name, help, type, {}});
    return families_.back();
  }
  void counter(const char* name, const char* help, double value) {
    family(name, MetricType::Counter, help).metric.push_back(counted(value));
  }
  void counter(const char* name, const char* help, std::uint64_t value) {
    counter(name, help, static_cast<double>(value));
  }
  void gauge(const char* name, const char* help, double value) {
    family(name, MetricType::Gauge, help).metric.push_back(measured(value, {}));
  }
  void gauge(const char* name, const char* help, std::uint64_t value) {
    gauge(name, help, static_cast<double>(value));
  }
  static ClientMetric counted(double value) {
    ClientMetric metric;
    metric.counter.value = value;
    return metric;
  }
  static ClientMetric measured(double value, Labels labels) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.gauge.value = value;
    return metric;
  }
  [[nodiscard]] std::string text() const {
    std::ostringstream out;
    prometheus::TextSerializer().Serialize(out, families_);
    return out.str();
  }

 private:
  std::vector<MetricFamily> families_;
};

std::uint64_t count_of(const proto::GetServerInfoResponse& info, const char* counter) {
  const auto found = info.counters().find(counter);
  return found == info.counters().end() ? 0 : found->second;
}

void add_server(Families& out, const proto::GetServerInfoResponse& info) {
  const auto& status = info.status();
  out.family("build_info", MetricType::Gauge, "Always 1; the label is the version of limberd.")
      .metric.push_back(Families::measured(1, {{"version", info.server_version()}}));
  out.gauge("uptime_seconds", "Since the start of the server.", info.uptime_s());
  out.gauge("ready", "1 while /readyz answers 200, else 0.",
            std::uint64_t{status.not_ready().empty()});
  out.gauge("faults", "Things that an operator should see to.",
            static_cast<std::uint64_t>(status.faults_size()));
  out.gauge("jobs_running", "Builds, simulations and other jobs that run.",
            std::uint64_t{status.running_jobs()});
}

void add_sessions(Families& out, const proto::ServerStatus& status) {
  std::map<std::pair<std::string, std::string>, double> by_kind;
  double people = 0, bytes = 0;
  for (const auto& session : status.sessions()) {
    ++by_kind[{session.kind(), session.state()}];
    people += session.people();
    bytes += static_cast<double>(session.bytes());
  }
  auto& sessions =
      out.family("sessions", MetricType::Gauge, "Sessions by kind and state, parked ones too.");
  for (const auto& [key, number] : by_kind)
    sessions.metric.push_back(
        Families::measured(number, {{"kind", key.first}, {"state", key.second}}));
  out.gauge("session_clients", "Clients in sessions; one in two of them counts twice.", people);
  out.gauge("session_bytes", "Estimated memory of sessions, as far as it is known.", bytes);
}

void add_requests(Families& out, const proto::GetServerInfoResponse& info) {
  const auto count = [&](const char* name, const char* counter, const char* help) {
    out.counter(name, help, count_of(info, counter));
  };
  count("requests_total", "requests", "Requests that came, readable or not.");
  count("replies_total", "replies", "Replies that were sent.");
  count("errors_total", "errors", "Replies that were errors, without waits that were not over.");
  count("malformed_requests_total", "malformed", "Requests whose bytes could not be read.");
  count("dropped_requests_total", "dropped_requests", "Requests that could not be answered.");
  count("dropped_replies_total", "dropped_replies",
        "Replies whose client was gone or read nothing.");
  count("refused_replies_total", "refused_replies",
        "Replies that were replaced by an error, as too much was left unread.");
  count("repeated_requests_total", "repeated_requests", "Requests that came again.");
  count("refused_handshakes_total", "refused_handshakes",
        "Connections with keys that are not allowed.");
  count("cut_off_connections_total", "cut_off", "Connections that the server ended.");
  count("stream_messages_total", "published",
        "Stream messages, with frames and without, by ZeroMQ.");
  count("page_stream_messages_total", "web_published",
        "Stream messages for pages, one for each page.");
  count("replaced_stream_messages_total", "replaced",
        "Stream messages that were given up for newer ones of their topic.");
  count("forced_stream_messages_total", "forced",
        "Stream messages that a subscriber missed, as it did not keep up.");
  count("followed_stream_messages_total", "followed",
        "Stream messages for those who follow streams.");
  count("stalled_followers_total", "stalled",
        "Followers of streams that were cut off, as they read nothing.");
  count("withheld_stream_messages_total", "withheld",
        "Stream messages that went to no subscriber, as too much was unread.");
  count("refused_pages_total", "web_refused",
        "HTTP requests without the right token, Host or Origin.");
  out.gauge("pages", "WebSockets that are open.", count_of(info, "web_connections"));
}

void add_queues(Families& out, const proto::QueueUse& queues) {
  out.gauge("open_requests", "Requests without an answer yet.", queues.open_requests());
  out.gauge("unread_reply_bytes", "Replies that clients leave unread.", queues.unread_bytes());
  out.gauge("waiting_requests", "Requests that wait for a thread.", queues.heavy_requests());
  out.gauge("waiting_request_bytes", "Bytes of these.", queues.heavy_bytes());
  out.gauge("stream_bytes", "Stream messages that anybody has still to read, each counted once.",
            queues.stream_bytes());
  out.gauge("followers", "Those who follow streams.", std::uint64_t{queues.reader_count()});
  double largest = 0;
  double left_out = 0;
  for (const auto& reader : queues.readers()) {
    largest =
        std::max(largest, static_cast<double>(reader.waiting_bytes() + reader.unread_bytes()));
    left_out += static_cast<double>(reader.left_out());
  }
  out.gauge("largest_follower_bytes", "What waits for one follower of streams or is unread, most.",
            largest);
  out.gauge("followers_left_out", "Stream messages that present followers were not sent.",
            left_out);
  out.gauge("page_queue_bytes", "Stream messages that wait for pages.", queues.page_bytes());
}

void add_acknowledgements(Families& out, const proto::LatencyHistogram& latencies) {
  ClientMetric metric;
  auto& histogram = metric.histogram;
  for (int i = 0; i < latencies.counts_size(); ++i) {
    histogram.sample_count += latencies.counts(i);
    const double bound = i < latencies.bounds_s_size() ? latencies.bounds_s(i)
                                                       : std::numeric_limits<double>::infinity();
    histogram.bucket.push_back({histogram.sample_count, bound});
  }
  histogram.sample_sum = latencies.sum_s();
  out.family("edit_acknowledgement_seconds", MetricType::Histogram,
             "From the arrival of a request of edits to its acknowledgement.")
      .metric.push_back(std::move(metric));
}

void add_store(Families& out, const proto::GetServerInfoResponse& info) {
  const auto& store = info.store();
  out.counter("store_syncs_total", "Syncs of the store's files to the disk (fsync).",
              count_of(info, "store_syncs"));
  out.counter("store_sync_seconds_total", "Time that these took.",
              static_cast<double>(count_of(info, "store_sync_us")) * 1e-6);
  out.counter("store_transactions_total", "Transactions of the store.", store.commits());
  out.counter("store_synced_transactions_total",
              "Transactions that were synced to the disk before they were acknowledged.",
              store.synced_commits());
  out.counter("store_changes_total", "Changes in these transactions.", store.changes());
  out.gauge("store_bytes", "Size of the store's files.", store.bytes());
  out.gauge("store_log_bytes", "Size of its write-ahead log, one of these.", store.log_bytes());
  out.gauge("store_sessions", "Sessions in the store.", std::uint64_t{store.sessions()});
  out.gauge("store_fault", "1 while the store cannot be written.",
            std::uint64_t{!store.fault().empty()});
  out.gauge("store_warning", "1 while the store has a warning, see `limber status`.",
            std::uint64_t{!store.warning().empty()});
}

/// By the names that Prometheus' own clients use.
void add_process(Families& out, const proto::ProcessUse& process) {
  out.gauge("process_resident_memory_bytes", "Memory of the process.", process.resident_bytes());
  out.counter("process_cpu_seconds_total", "Processor time of all threads.", process.cpu_s());
  out.gauge("process_open_fds", "Open file descriptors.", std::uint64_t{process.open_files()});
  out.gauge("process_max_fds", "File descriptors that may be open.", process.most_open_files());
  out.gauge("process_threads", "Threads.", std::uint64_t{process.threads()});
}

}  // namespace

std::string metrics_text(const proto::GetServerInfoResponse& info) {
  Families out;
  add_server(out, info);
  add_sessions(out, info.status());
  add_requests(out, info);
  add_queues(out, info.status().queues());
  add_acknowledgements(out, info.status().acknowledgements());
  if (info.has_store()) add_store(out, info);
  add_process(out, info.status().process());
  return out.text();
}

}  // namespace limber::server
