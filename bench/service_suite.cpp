// Real sockets, real processes: one client edits the flower, one edit after another, and times what
// a person would notice: acknowledgement, the first changed frames, the final frames.
#include <fmt/core.h>

#include <atomic>
#include <condition_variable>
#include <iterator>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/find_program.h"
#include "bench/live_server.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;

struct Latencies {
  std::vector<double> ack, first_frame, converged;
};

using Clock = std::chrono::steady_clock;

/// When frames came, by their revision: read on a thread of its own, since frames may come before
/// the acknowledgement.
class Arrivals {
 public:
  Arrivals(LiveClient& client, const ServerProcess& server) : stream_(client.context(), server) {
    stream_.subscribe("session/bench/body/0/coordinates");
    thread_ = std::thread([this] { read(); });
  }
  ~Arrivals() {
    is_ending_.store(true);
    thread_.join();
  }
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  struct Times {
    Clock::time_point first, converged;
  };
  /// Of the revision that comes next, or a newer one. Waits for it.
  Times of(std::uint64_t revision) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return converged_revision_ >= revision || !fault_.empty(); });
    if (!fault_.empty()) throw std::runtime_error(fault_);
    const auto first = first_.lower_bound(revision);
    const Times times{first->second, converged_};
    first_.erase(first_.begin(), std::next(first));
    return times;
  }

 private:
  void read() {
    try {
      while (!is_ending_.load()) {
        if (!stream_.has_next(std::chrono::milliseconds(100))) continue;
        const pb::Frames frames = stream_.next_frames();
        const auto now = Clock::now();
        const std::lock_guard lock(mutex_);
        first_.try_emplace(frames.result().revision(), now);
        if (frames.result().converged() && frames.result().revision() > converged_revision_) {
          converged_revision_ = frames.result().revision();
          converged_ = now;
        }
        arrived_.notify_all();
      }
    } catch (const std::exception& fault) {
      const std::lock_guard lock(mutex_);
      fault_ = fault.what();
      arrived_.notify_all();
    }
  }

  LiveStream stream_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::uint64_t, Clock::time_point> first_;
  std::uint64_t converged_revision_ = 0;
  Clock::time_point converged_;
  std::string fault_;
  std::atomic<bool> is_ending_{false};
  std::thread thread_;  // last: it uses the rest
};

/// Moves the constraints in turn, waiting for the final frames each time.
Latencies edit_one_by_one(LiveClient& client, Arrivals& arrivals, const std::string& session,
                          const pb::Scene& scene, int edits) {
  Latencies latencies;
  for (int i = 0; i < edits; ++i) {
    const pb::Request request = circling_edit(session, scene, i);
    const auto start = Clock::now();
    const auto ms = [&](Clock::time_point until) {
      return std::chrono::duration<double, std::milli>(until - start).count();
    };
    const std::uint64_t revision = client.call(request).edit().revision();
    latencies.ack.push_back(ms(Clock::now()));
    const Arrivals::Times times = arrivals.of(revision);
    latencies.first_frame.push_back(ms(times.first));
    latencies.converged.push_back(ms(times.converged));
  }
  return latencies;
}

/// Whether edits are stored before they are acknowledged, and how.
struct Journal {
  const char* name;
  std::vector<std::string> options;
};

Case measure(const SuiteOptions& options, Recorder& recorder, const Journal& journal) {
  const ServerProcess server(find_program("limberd", options.limberd), journal.options);
  LiveClient client(server);
  recorder.note(fmt::format("service: building the flower's model, journal {}", journal.name));
  const pb::GetSessionResponse opened = open_sample(client, "flower", "bench");
  Latencies latencies;
  const int edits = options.quick ? 500 : 2000;
  const auto commits = [&] {
    pb::Request request;
    request.mutable_get_server_info();
    return client.call(request).get_server_info().store().commits();
  };
  std::uint64_t begun_at = 0, ended_at = 0;
  Clock::time_point begin, end;
  {
    Arrivals arrivals(client, server);
    std::this_thread::sleep_for(
        std::chrono::milliseconds(300));  // until the subscription has arrived
    recorder.note(fmt::format("service: {} edits, one by one", edits));
    edit_one_by_one(client, arrivals, "bench", opened.scene(), 20);  // warm-up, not counted
    begun_at = commits();
    begin = Clock::now();
    latencies = edit_one_by_one(client, arrivals, "bench", opened.scene(), edits);
    end = Clock::now();
    ended_at = commits();
  }
  const double seconds = std::chrono::duration<double>(end - begin).count();
  Case result;
  result["scene"] = "flower";
  result["journal"] = journal.name;
  result["tets"] = opened.status().tets();
  result["frames"] = opened.status().frames();
  result["constraints"] = opened.status().constraints();
  result["basis"] = opened.status().model().basis_size();
  result["cubature_tets"] = opened.status().model().cubature_size();
  result["edits"] = edits;
  result["edits_per_s"] = edits / seconds;
  result["commits_per_s"] = static_cast<double>(ended_at - begun_at) / seconds;
  result["edit_to_ack_p50_ms"] = quantile(latencies.ack, 0.5);
  result["edit_to_ack_p99_ms"] = quantile(latencies.ack, 0.99);
  result["edit_to_first_frame_p50_ms"] = quantile(latencies.first_frame, 0.5);
  result["edit_to_first_frame_p99_ms"] = quantile(latencies.first_frame, 0.99);
  result["edit_to_converged_p50_ms"] = quantile(latencies.converged, 0.5);
  result["edit_to_converged_p99_ms"] = quantile(latencies.converged, 0.99);
  return result;
}

}  // namespace

void service_suite(const SuiteOptions& options, Recorder& recorder) {
  const std::vector<Journal> journals{
      {"off", {}},
      {"process", {"--data", "FOLDER", "--data-outlives", "process"}},
      {"power", {"--data", "FOLDER"}}};
  for (const Journal& journal : journals) recorder.add(measure(options, recorder, journal));
}

}  // namespace limber::bench
