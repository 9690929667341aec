// Time of an edit of a session as its frames become more: over real sockets, by one client that
// follows changes, in coordinates. The flower with its own constraints, spread over so many frames;
// each edit moves a target. `ms`: medians until the first changed frames, until all of them (by the
// reduced model) and until those of the final result are at the client. Rows as those of
// growth_bodies, which measures the solver alone.
#include <fmt/core.h>

#include <cmath>
#include <thread>

#include "bench/find_program.h"
#include "bench/growth_rows.h"
#include "bench/live_server.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;

/// The same constraints over another number of frames, at least as many.
pb::Scene stretched(pb::Scene scene, int frames) {
  const double share = static_cast<double>(frames) / scene.frames();
  for (pb::Constraint& constraint : *scene.mutable_constraints())
    constraint.set_frame(static_cast<std::uint32_t>(std::floor(share * constraint.frame())));
  scene.set_frames(static_cast<std::uint32_t>(frames));
  return scene;
}

void grow_session(LiveClient& client, const pb::Scene& flower, int frames, int edits,
                  Recorder& recorder) {
  using Clock = std::chrono::steady_clock;
  recorder.note(fmt::format("growth_sessions: {} frames", frames));
  const std::string session = fmt::format("frames-{}", frames);
  const pb::Scene scene = open_scene(client, stretched(flower, frames), session).scene();
  client.subscribe("session/" + session + "/body/0/changes");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  std::vector<double> first, all, final;
  for (int i = 0; i < 1 + edits; ++i) {
    const pb::Request request = circling_edit(session, scene, i);
    const auto start = Clock::now();
    const auto since_ms = [&] {
      return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    };
    const std::uint64_t revision = client.call(request).edit().revision();
    double first_ms = 0, all_ms = 0;
    while (true) {
      const pb::Frames message = client.next_frames();
      if (message.result().revision() < revision) continue;
      if (first_ms == 0) first_ms = since_ms();
      if (message.changes().early() || message.changes().more()) continue;
      if (all_ms == 0) all_ms = since_ms();
      if (message.result().converged()) break;
    }
    if (i == 0) continue;  // the first is not warm yet
    first.push_back(first_ms);
    all.push_back(all_ms);
    final.push_back(since_ms());
  }
  for (const auto& [what, values] : {std::pair{"first changed frames", &first},
                                     {"all changed frames", &all},
                                     {"final frames", &final}}) {
    Case row = growth_row("frames of a session", frames, what, median(*values));
    row["ms_most"] = quantile(*values, 1);
    recorder.add(row);
  }
  pb::Request close;
  close.mutable_close_session()->set_session(session);
  client.call(close);
}

}  // namespace

void growth_sessions_suite(const SuiteOptions& options, Recorder& recorder) {
  const ServerProcess server(find_program("limberd", options.limberd));
  LiveClient client(server);
  pb::Request get_sample;
  get_sample.mutable_get_sample()->set_name("flower");
  const pb::Scene flower = client.call(get_sample).get_sample().scene();
  std::vector<int> sizes{400, 1000, 3000, 10000};
  if (!options.quick) sizes.insert(sizes.end(), {30000, 100000});
  for (const int frames : sizes)
    grow_session(client, flower, frames, frames > 20000 ? 5 : 15, recorder);
}

}  // namespace limber::bench
