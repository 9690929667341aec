#include "bench/beam_live.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "engine/session/beams/live_problem.h"
#include "tests/support/beam_structures.h"

namespace limber::bench {
namespace {

using session::BeamConditions;
using Conditions = std::shared_ptr<const BeamConditions>;

/// A node that is held, brought on by so much: along its motion, else towards the middle.
Conditions brought_on(const BeamConditions& conditions, const beams::BeamModel& model, int which,
                      double by) {
  auto edited = std::make_shared<BeamConditions>(conditions);
  edited->temporary_loads.clear();
  if (!edited->motions.empty()) {
    auto& motion = edited->motions[static_cast<std::size_t>(which) % edited->motions.size()];
    if (motion.translation.norm() > 0) {
      motion.translation += by * motion.translation.normalized();
      return edited;
    }
  }
  auto& support = edited->supports[static_cast<std::size_t>(which) % edited->supports.size()];
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const beams::BeamNode& node : model.nodes)
    middle += node.position / static_cast<double>(model.nodes.size());
  const Eigen::Vector3d place = model.nodes[static_cast<std::size_t>(support.node)].position;
  beams::PrescribedMotion motion;
  motion.node = support.node;
  motion.translation = by * (middle - place).normalized();
  for (std::size_t k = 0; k < 3; ++k) motion.translates[k] = std::exchange(support.fixed[k], false);
  edited->motions.push_back(motion);
  return edited;
}

}  // namespace

void add_live_figures(const beams::BeamModel& model, int supports, LiveEdits which, Case& result) {
  session::LiveBeams live(model);
  const Conditions drawn = std::make_shared<const BeamConditions>(session::conditions_of(model));
  const auto solve = [&live](const Conditions& conditions) {
    return live.solve(conditions, {}, [](const beams::BeamState&) {});
  };
  bool reached = false;
  result["live_open_s"] = 1e-3 * milliseconds([&] { reached = solve(drawn).reached; });
  if (!reached) return;
  const double extent = testing::extent_of(model);
  const int places = static_cast<int>(std::max<std::size_t>(
      1, model.motions.empty() ? model.supports.size() : model.motions.size()));
  int failed = 0;
  for (const bool far : {false, true}) {
    if (far && which == LiveEdits::kNear) break;
    std::vector<double> times;
    int snaps = 0;
    for (int i = 0; i < supports; ++i) {
      const Conditions edited =
          brought_on(*drawn, model, i * places / supports, (far ? 0.05 : 0.002) * extent);
      session::LiveBeams::Outcome outcome;
      times.push_back(milliseconds([&] { outcome = solve(edited); }));
      snaps += static_cast<int>(outcome.report.snaps.size());
      if (!outcome.reached) ++failed;
      (void)solve(drawn);  // known: back at once
    }
    result[far ? "live_far_edit_ms" : "live_edit_ms"] = median(times);
    result[far ? "live_far_snaps" : "live_snaps"] = snaps;
  }
  result["live_failed"] = failed;
}

}  // namespace limber::bench
