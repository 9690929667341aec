// Opening a linkage from flat as its design knows it.

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "engine/rods/design/erection.h"
#include "engine/session/linkage/live_linkage.h"

namespace limber::session {
namespace {

constexpr double kPushStep = 0.25;  // share of the push, at angles that stay

/// Paths one after the other, as one.
void append(LiveLinkage::Outcome& whole, LiveLinkage::Outcome part, double from, double share) {
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
  whole.way_end = std::move(part.way_end);
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

}  // namespace

/// Does the linkage lie about flat, and is it to open?
bool LiveLinkage::is_erected_by(const scene::LinkageConditions& conditions,
                                const rods::Conditions& wanted) const {
  constexpr double kFlatShare = 0.25, kOpenShare = 0.25;  // of the erection's path
  constexpr double kLeastPath = 0.02;                     // [rad]
  const auto& erection = conditions.erection;
  if (!erection || erection->push.empty() || !wanted.mean_opening_angle) return false;
  const double now = state_.mean_opening_angle();
  const double flat = erection->path.empty() ? now : erection->path.front();
  const double path = erection->mean_angle - flat;
  if (!(std::abs(path) > kLeastPath)) return false;
  const double from = (now - flat) / path;
  const double to = (*wanted.mean_opening_angle - flat) / path;
  return from < kFlatShare && to > from + kOpenShare;
}

/// @param remark  gets what is to be said of it
/// @returns false where it is not to be erected, or was not to be reached so: then it is where it
/// was, and the outcome is empty
bool LiveLinkage::erect(const scene::LinkageConditions& conditions, const rods::Conditions& wanted,
                        const JobContext& job, const OnIterate& on_iterate, Outcome& outcome,
                        std::string& remark) {
  if (!is_erected_by(conditions, wanted)) return false;
  std::vector<rods::JointLoad> push;
  for (const scene::JointLoad& load : conditions.erection->push) {
    push.push_back(
        {load.joint, load.force, load.moment / length_unit_, load.torque / length_unit_});
  }
  const std::vector<rods::Conditions> stages = rods::erection_stages(state_, wanted, push);
  Outcome erected;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    Outcome part;
    lead(stages[k], std::min(share_of_step(stages[k]), kPushStep), job, on_iterate, part);
    const double share = 1 / static_cast<double>(stages.size());
    append(erected, std::move(part), static_cast<double>(k) * share, share);
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
