#include "engine/session/linkage/length_path.h"

#include <cmath>

namespace limber::session {
namespace {

constexpr double kStep = 0.02;  // largest change of a length that one solve takes, as a share
constexpr double kTolerance = 1e-4;

}  // namespace

rods::EquilibriumReport follow_lengths(rods::LinkageModel& model,
                                       rods::LinkageEquilibrium& equilibrium,
                                       rods::LinkageState& state, const rods::Conditions& held,
                                       const Eigen::VectorXd& lengths, const JobContext& job,
                                       const std::function<void()>& on_step) {
  rods::EquilibriumReport report;
  report.status = rods::EquilibriumStatus::kConverged;
  const Eigen::VectorXd from = model.segment_lengths();
  const double change = (lengths - from).cwiseQuotient(from).cwiseAbs().maxCoeff();
  const int steps = static_cast<int>(std::ceil(change / kStep));
  for (int k = 1; k <= steps; ++k) {
    if (k < steps) {
      model.set_segment_lengths(from + static_cast<double>(k) / steps * (lengths - from));
    } else {
      model.set_segment_lengths(lengths);
    }
    report = equilibrium.solve(state, held, {.tolerance = kTolerance}, job);
    if (!report.converged()) return report;
    if (on_step) on_step();
  }
  return report;
}

}  // namespace limber::session
