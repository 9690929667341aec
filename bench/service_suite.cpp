// Real sockets, real processes: one client edits the flower, one edit after another, and times what
// a person would notice: acknowledgement, the first changed frames, the final frames.
#include <fmt/core.h>

#include <thread>

#include "bench/find_program.h"
#include "bench/live_server.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;

struct Latencies {
  std::vector<double> ack, first_frame, converged;
};

/// Moves the constraints in turn, waiting for the final frames each time.
Latencies edit_one_by_one(LiveClient& client, const std::string& session, const pb::Scene& scene,
                          int edits) {
  using Clock = std::chrono::steady_clock;
  Latencies latencies;
  for (int i = 0; i < edits; ++i) {
    const pb::Request request = circling_edit(session, scene, i);
    const auto start = Clock::now();
    const auto since_ms = [&] {
      return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    };
    const std::uint64_t revision = client.call(request).edit().revision();
    latencies.ack.push_back(since_ms());
    bool first = true;
    while (true) {
      const pb::Frames frames = client.next_frames();
      if (frames.result().revision() < revision) continue;
      if (first) latencies.first_frame.push_back(since_ms());
      first = false;
      if (frames.result().converged()) break;
    }
    latencies.converged.push_back(since_ms());
  }
  return latencies;
}

}  // namespace

void service_suite(const SuiteOptions& options, Recorder& recorder) {
  const ServerProcess server(find_program("limberd", options.limberd));
  LiveClient client(server);
  recorder.note("service: building the flower's model");
  const pb::GetSessionResponse opened = open_sample(client, "flower", "bench");
  client.subscribe("session/bench/body/0/coordinates");
  std::this_thread::sleep_for(
      std::chrono::milliseconds(300));  // until the subscription has arrived

  const int edits = options.quick ? 500 : 2000;
  recorder.note(fmt::format("service: {} edits, one by one", edits));
  edit_one_by_one(client, "bench", opened.scene(), 20);  // warm-up, not counted
  const Latencies latencies = edit_one_by_one(client, "bench", opened.scene(), edits);

  Case result;
  result["scene"] = "flower";
  result["tets"] = opened.status().tets();
  result["frames"] = opened.status().frames();
  result["constraints"] = opened.status().constraints();
  result["basis"] = opened.status().model().basis_size();
  result["cubature_tets"] = opened.status().model().cubature_size();
  result["edits"] = edits;
  result["edit_to_ack_p50_ms"] = quantile(latencies.ack, 0.5);
  result["edit_to_ack_p99_ms"] = quantile(latencies.ack, 0.99);
  result["edit_to_first_frame_p50_ms"] = quantile(latencies.first_frame, 0.5);
  result["edit_to_first_frame_p99_ms"] = quantile(latencies.first_frame, 0.99);
  result["edit_to_converged_p50_ms"] = quantile(latencies.converged, 0.5);
  result["edit_to_converged_p99_ms"] = quantile(latencies.converged, 0.99);
  recorder.add(result);
}

}  // namespace limber::bench
