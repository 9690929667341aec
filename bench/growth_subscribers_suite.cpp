// How long an edit takes to arrive everywhere as subscribers of a session's frames become more. One
// client edits the flower over real sockets. `ms` is the median from the edit until the last of
// `size` subscribers has the first changed frames, and until it has the final ones. All subscribers
// are read by one thread of this process, which shares the machine with the server.
#include <fmt/core.h>

#include <memory>
#include <thread>

#include "bench/find_program.h"
#include "bench/growth_rows.h"
#include "bench/live_server.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;

struct ArrivalTimes {
  std::vector<double> first, final;  // of each edit, at the last subscriber [ms]
};

ArrivalTimes edit_for_all(LiveClient& client, const pb::Scene& scene,
                          const std::vector<std::unique_ptr<LiveStream>>& streams, int edits) {
  using Clock = std::chrono::steady_clock;
  ArrivalTimes times;
  for (int i = 0; i < edits; ++i) {
    const pb::Request request = circling_edit("bench", scene, i);
    const auto start = Clock::now();
    const std::uint64_t revision = client.call(request).edit().revision();
    const auto until = [&](const auto& has_come) {
      for (const auto& stream : streams)
        while (!has_come(stream->next_frames().result())) {
        }
      return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    };
    std::size_t finals = 0;
    times.first.push_back(until([&](const pb::ResultInfo& result) {
      if (result.revision() == revision && result.converged()) ++finals;
      return result.revision() == revision;
    }));
    if (finals == streams.size()) {  // the first was the final one
      times.final.push_back(times.first.back());
      continue;
    }
    if (finals > 0) throw std::runtime_error("subscribers were sent different results");
    times.final.push_back(until([&](const pb::ResultInfo& result) {
      return result.revision() == revision && result.converged();
    }));
  }
  return times;
}

}  // namespace

void growth_subscribers_suite(const SuiteOptions& options, Recorder& recorder) {
  const ServerProcess server(find_program("limberd", options.limberd));
  LiveClient client(server);
  recorder.note("growth_subscribers: building the flower's model");
  const pb::GetSessionResponse opened = open_sample(client, "flower", "bench");
  std::vector<std::unique_ptr<LiveStream>> streams;
  for (const std::size_t count : {1, 2, 4, 8, 16, 32, 64}) {
    while (streams.size() < count) {
      streams.push_back(std::make_unique<LiveStream>(client.context(), server));
      streams.back()->subscribe("session/bench/body/0/coordinates");
    }
    // Until subscriptions have arrived.
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    recorder.note(fmt::format("growth_subscribers: {}", count));
    edit_for_all(client, opened.scene(), streams, 3);
    const ArrivalTimes times =
        edit_for_all(client, opened.scene(), streams, options.quick ? 40 : 150);
    for (const auto& [what, values] : {std::pair{"first changed frames at the last", &times.first},
                                       {"final frames at the last", &times.final}}) {
      Case row = growth_row("subscribers", count, what, median(*values));
      row["p99_ms"] = quantile(*values, 0.99);
      recorder.add(row);
    }
  }
}

}  // namespace limber::bench
