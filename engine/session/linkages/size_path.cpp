#include "engine/session/linkages/size_path.h"

#include <algorithm>
#include <cmath>

namespace limber::session {
namespace {

constexpr double kStep = 0.02;  // largest change of a size that one solve takes, as a share
constexpr double kTolerance = 1e-4;

}  // namespace

rods::EquilibriumReport follow_sizes(rods::LinkageModel& model, RodSizes& sizes,
                                     rods::LinkageEquilibrium& equilibrium,
                                     rods::LinkageState& state, const rods::Conditions& held,
                                     const RodSizes& target, const JobContext& job,
                                     const std::function<void()>& on_step) {
  rods::EquilibriumReport report;
  report.status = rods::EquilibriumStatus::kConverged;
  const RodSizes from = sizes;
  // One at least: the same lengths, of edges in place of segments, are brought, too.
  const double change = largest_change(model, from, target);
  const int steps = std::max(1, static_cast<int>(std::ceil(change / kStep)));
  for (int k = 1; k <= steps; ++k) {
    RodSizes next =
        k < steps ? sizes_between(model, from, target, static_cast<double>(k) / steps) : target;
    set_sizes(model, next);
    sizes = std::move(next);
    report = equilibrium.solve(state, held, {.tolerance = kTolerance}, job);
    if (!report.converged()) return report;
    if (on_step) on_step();
  }
  return report;
}

}  // namespace limber::session
