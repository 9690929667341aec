// Real sockets, real processes. One client edits the flower, one edit after another, and times the
// visible steps: acknowledgement, the first changed frames, the final frames.
#include <fmt/core.h>

#include <string>
#include <thread>
#include <vector>

#include "bench/arrivals.h"
#include "bench/find_program.h"
#include "bench/live_server.h"
#include "bench/service_clients.h"
#include "bench/service_parked.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;

struct Latencies {
  std::vector<double> ack, first_frame, converged;
};

using Clock = Arrivals::Clock;

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
  const int edits = options.quick ? 30 : 300;  // a third of a second each until they are final
  const auto commits = [&] {
    pb::Request request;
    request.mutable_get_server_info();
    return client.call(request).get_server_info().store().commits();
  };
  std::uint64_t begun_at = 0, ended_at = 0;
  Clock::time_point begin, end;
  {
    Arrivals arrivals(client, server, "bench");
    std::this_thread::sleep_for(
        std::chrono::milliseconds(300));  // until the subscription has arrived
    recorder.note(fmt::format("service: {} edits, one by one", edits));
    edit_one_by_one(client, arrivals, "bench", opened.scene(), 5);  // warm-up, not counted
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
  // As they would be used: dragged by one, by a class, and looked after by an office.
  const double seconds = options.quick ? 5 : 20;
  for (const ServiceLoad& load : {ServiceLoad{1, 30, seconds}, ServiceLoad{1, 30, seconds, 3},
                                  ServiceLoad{8, 4, seconds}, ServiceLoad{64, 1, seconds}}) {
    for (const Journal& journal : journals) {
      // One client is sufficient to show the cost of storing.
      if (journal.options.empty() && (load.clients > 1 || load.builders > 0)) continue;
      Case row = measure_clients(options, recorder, load, "flower", journal.options);
      row["journal"] = journal.name;
      recorder.add(row);
    }
  }
  recorder.add(measure_parked(options, recorder, options.quick ? 200 : 1000));
}

}  // namespace limber::bench
