#include "bench/service_parked.h"

#include <fmt/core.h>

#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "bench/bar_body.h"
#include "bench/find_program.h"
#include "bench/live_server.h"
#include "server/wire/arrays.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;
using Clock = std::chrono::steady_clock;

/// Sessions that are requested again, spread over all.
constexpr int kReturns = 50;
constexpr std::chrono::seconds kUntilAllRest{120};

/// A bar of 144 tets that is pulled aside at its free end.
pb::Scene small_scene() {
  const bodies::ElasticBody body = bar_body(2);
  pb::Scene scene;
  scene.set_name("bar");
  *scene.mutable_mesh()->mutable_arrays()->mutable_nodes() =
      server::encode_points_float64(body.mesh.nodes);
  *scene.mutable_mesh()->mutable_arrays()->mutable_tets() = server::encode_indices(body.mesh.tets);
  for (const int node : body.fixed_nodes) scene.add_fixed_nodes(static_cast<std::uint32_t>(node));
  scene.set_frames(60);
  pb::Constraint& constraint = *scene.add_constraints();
  constraint.set_id(1);
  constraint.set_frame(30);
  constraint.add_nodes(static_cast<std::uint32_t>(body.mesh.node_count() - 1));
  constraint.mutable_displacement()->set_y(0.3);
  return scene;
}

double number_of(LiveClient& client, const std::string& counter) {
  pb::Request request;
  request.mutable_get_server_info();
  const auto info = client.call(request).get_server_info();
  const auto found = info.counters().find(counter);
  return found == info.counters().end() ? 0 : static_cast<double>(found->second);
}

double resident_mb(LiveClient& client) {
  pb::Request request;
  request.mutable_get_server_info()->set_with_status(true);
  return static_cast<double>(
             client.call(request).get_server_info().status().process().resident_bytes()) /
         1e6;
}

double in_ms(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

}  // namespace

Case measure_parked(const SuiteOptions& options, Recorder& recorder, int sessions) {
  const ServerProcess server(
      find_program("limberd", options.limberd),
      {"--data", "FOLDER", "--data-outlives", "process", "--park-after", "3"});
  LiveClient client(server);
  recorder.note(fmt::format("service: {} sessions that rest", sessions));
  const pb::Scene scene = small_scene();
  const auto name = [](int i) { return fmt::format("rests-{}", i); };
  for (int i = 0; i < sessions; ++i) {
    open_scene(client, scene, name(i));
    client.wait_final(name(i), client.call(circling_edit(name(i), scene, i)).edit().revision());
  }
  const auto give_up = Clock::now() + kUntilAllRest;
  while (number_of(client, "parked") < sessions) {
    if (Clock::now() > give_up) throw std::runtime_error("not all sessions were parked");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  const double parked_mb = resident_mb(client);
  std::vector<double> status, frames;
  for (int i = 0; i < kReturns; ++i) {
    const std::string session = name(i * (sessions / kReturns));
    const auto begin = Clock::now();
    pb::Request request;
    request.mutable_get_session()->set_session(session);
    client.call(request);
    status.push_back(in_ms(Clock::now() - begin));
    pb::Request wanted;
    wanted.mutable_get_frames()->set_session(session);
    client.call(wanted);
    frames.push_back(in_ms(Clock::now() - begin));
  }
  Case row;
  row["scene"] = "bar";
  row["parked_sessions"] = sessions;
  row["rss_mb"] = parked_mb;
  row["back_p50_ms"] = quantile(status, 0.5);
  row["back_max_ms"] = quantile(status, 1);
  row["back_with_frames_p50_ms"] = quantile(frames, 0.5);
  row["back_with_frames_max_ms"] = quantile(frames, 1);
  return row;
}

}  // namespace limber::bench
