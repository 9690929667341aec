// Opening a linkage from flat as its design knows it.

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/rods/design/erection.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/session/linkages/live_linkage.h"

namespace limber::session {
namespace {

constexpr double kPushStep = 0.25;  // share of the push, at angles that stay

/// share_along of shapes that have left the plane for one of its sides.
constexpr double kLeastSide = 0.01;

/// Paths one after the other, as one.
void append_outcome(LiveLinkage::Outcome& whole, LiveLinkage::Outcome part, double from,
                    double share) {
  for (rods::DeploymentStep step : part.path) {
    step.progress = from + share * step.progress;
    whole.path.push_back(step);
  }
  for (Eigen::VectorXf& frame : part.frames) whole.frames.push_back(std::move(frame));
  for (Eigen::VectorXf& strains : part.strains) whole.strains.push_back(std::move(strains));
  const int iterations = whole.report.iterations, corrections = whole.report.corrections;
  const int factorizations = whole.report.factorizations;
  whole.report = std::move(part.report);
  whole.report.iterations += iterations;
  whole.report.corrections += corrections;
  whole.report.factorizations += factorizations;
  whole.path_end = std::move(part.path_end);
  whole.reached = part.reached;
}

std::string describe_failed_erection(const LiveLinkage::Outcome& erected) {
  const double share = erected.path.empty() ? 0 : erected.path.back().progress;
  return fmt::format(
      "the erection of this design stopped at {:.0f} % ({}); opened without its push, the shape "
      "may "
      "be on another branch",
      100 * share, erected.report.message);
}

/// How far the joints are displaced along the push, as a share of the linkage's size, both
/// root mean square: 0 in the plane that the push is normal to, and of opposite signs to its sides.
double share_along(const std::vector<scene::JointLoad>& push, const Eigen::Matrix3Xd& joints) {
  const Eigen::Matrix3Xd offsets = joints.colwise() - joints.rowwise().mean();
  double work = 0, squares = 0;
  for (const scene::JointLoad& load : push) {
    work += load.force.dot(offsets.col(load.joint));
    squares += load.force.squaredNorm();
  }
  const double size = std::sqrt(squares) * offsets.norm();
  return size > 0 ? work / size : 0;
}

}  // namespace

/// Is the linkage to open from where its branch is not decided: from the beginning of the path, or
/// from a shape that is still about flat? Below the angle at which it buckles, the equilibrium
/// without the push is flat again after each step, however far along the path that is.
bool LiveLinkage::is_erected_by(const scene::LinkageConditions& conditions,
                                const rods::Conditions& target, std::string& remark) const {
  constexpr double kFlatShare = 0.25;  // of the erection's path
  constexpr double kLeastStep = 1e-3;  // of the same: smaller rises are rounding
  constexpr double kLeastPath = 0.02;  // [rad]
  const auto& erection = conditions.erection;
  if (!erection || erection->push.empty() || !target.mean_opening_angle) return false;
  const double now = state_.mean_opening_angle();
  const double flat = erection->path.empty() ? now : erection->path.front();
  const double path = erection->mean_angle - flat;
  if (!(std::abs(path) > kLeastPath)) return false;
  const double from = (now - flat) / path;
  const double to = (*target.mean_opening_angle - flat) / path;
  if (!(to > from + kLeastStep)) return false;
  if (from < kFlatShare) return true;
  const double side = share_along(erection->push, rods::joint_positions(state_));
  if (side < -kLeastSide) {
    remark = fmt::format(
        "the shape is on the other side of its plane than the designed one: deploy it to {:.4g} "
        "degrees and open it again from there",
        flat / kDegree);
  }
  return std::abs(side) <= kLeastSide;
}

/// @param remark  gets the remark on it
/// @returns false where it is not to be erected, or was not to be reached so: then it is where it
/// was, and the outcome is empty
bool LiveLinkage::erect(const scene::LinkageConditions& conditions, const rods::Conditions& target,
                        const JobContext& job, const OnIterate& on_iterate, Outcome& outcome,
                        std::string& remark) {
  if (!is_erected_by(conditions, target, remark)) return false;
  std::vector<rods::JointLoad> push;
  for (const scene::JointLoad& load : conditions.erection->push) {
    push.push_back(
        {load.joint, load.force, load.moment / length_unit_, load.torque / length_unit_});
  }
  const std::vector<rods::Conditions> stages = rods::erection_stages(state_, target, push);
  Outcome erected;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    Outcome part;
    lead(stages[k], std::min(share_of_step(stages[k]), kPushStep), job, on_iterate, part);
    const double share = 1 / static_cast<double>(stages.size());
    append_outcome(erected, std::move(part), static_cast<double>(k) * share, share);
    if (!erected.reached) break;
  }
  if (!erected.reached && erected.report.status != rods::EquilibriumStatus::kCancelled) {
    remark = describe_failed_erection(erected);
    restore();
    return false;
  }
  const bool is_loaded =
      !conditions.loads.empty() || !conditions.targets.empty() || !conditions.gravity.isZero(0);
  if (erected.reached && is_loaded) {
    remark =
        "the erection of this design was found without loads, springs and weight: under these the "
        "shape may be on another branch";
  }
  outcome = std::move(erected);
  return true;
}

}  // namespace limber::session
