// Opening a linkage from flat as its design knows it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/rods/design/erection.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/session/linkages/live_problem.h"

namespace limber::session {
namespace {

constexpr double kPushStep = 0.25;             // share of the push, at angles that stay
constexpr double kLeastOpening = 1 * kDegree;  // of the mean angle: that opens a linkage

/// Is a shape rather the mirror image of the one before? Flat shapes are their own.
bool is_mirrored(const Eigen::Matrix3Xd& before, const Eigen::Matrix3Xd& now) {
  constexpr double kFar = 0.02;  // of the size, rms: a larger change is not small
  const double size = (before.colwise() - before.rowwise().mean()).norm() /
                      std::sqrt(std::max(1.0, static_cast<double>(before.cols())));
  const double apart = rods::distance_between_shapes(now, before);
  return apart > kFar * size && rods::distance_to_mirror_image(now, before) < apart / 2;
}

/// share_along of shapes that have left the plane for one of its sides.
constexpr double kLeastSide = 0.01;

/// Paths one after the other, as one.
void append_outcome(LiveLinkage::Outcome& whole, LiveLinkage::Outcome part, double from,
                    double share) {
  for (rods::DeploymentStep step : part.path) {
    step.progress = from + share * step.progress;
    whole.path.push_back(step);
  }
  for (Eigen::VectorXd& frame : part.frames) whole.frames.push_back(std::move(frame));
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

/// Mean displacement of the joints along the push, as a share of the linkage's size, both root mean
/// square. It is 0 in the plane normal to the push, and of opposite signs on its two sides.
double share_along(const std::vector<rods::JointLoad>& push, const Eigen::Matrix3Xd& joints) {
  const Eigen::Matrix3Xd offsets = joints.colwise() - joints.rowwise().mean();
  double work = 0, squares = 0;
  for (const rods::JointLoad& load : push) {
    work += load.force.dot(offsets.col(load.joint));
    squares += load.force.squaredNorm();
  }
  const double size = std::sqrt(squares) * offsets.norm();
  return size > 0 ? work / size : 0;
}

/// Compares the shape with the one that the erection leads to; empty: it is that one, or other
/// angles or loads say that it need not be.
std::string describe_missed_shape(const scene::LinkageConditions& conditions,
                                  const Eigen::Matrix3Xd& joints, double extent) {
  constexpr double kSameAngle = 1e-6;  // [rad]
  constexpr double kSameShape = 1e-3;  // of the extent: distance of shapes that are one
  const scene::LinkageErection& erection = *conditions.erection;
  const bool is_loaded =
      !conditions.loads.empty() || !conditions.targets.empty() || !conditions.gravity.isZero(0);
  if (erection.positions.cols() != joints.cols() || is_loaded || !conditions.mean_angle ||
      std::abs(*conditions.mean_angle - erection.mean_angle) > kSameAngle)
    return {};
  const double apart = rods::distance_between_shapes(joints, erection.positions);
  if (!(apart > kSameShape * extent)) return {};
  const double mirrored = rods::distance_to_mirror_image(joints, erection.positions);
  if (mirrored < apart / 2) {
    return fmt::format(
        "the shape is the mirror image of the designed one (joints are {:.3g} off, rms): deploy it "
        "to its flat angle and open it again",
        apart);
  }
  return fmt::format("the shape is not the designed one: joints are {:.3g} off (rms)", apart);
}

/// Do conditions take the shape elsewhere themselves? A pin that stays where its joint was does
/// not.
bool drives(const scene::LinkageConditions& conditions, const Eigen::Matrix3Xd& before,
            double extent) {
  constexpr double kSamePlace = 1e-6;  // of the extent
  const auto moves = [&](const scene::JointPin& pin) {
    return pin.position && pin.held != scene::Held::kAngle &&
           (*pin.position - before.col(pin.joint)).norm() > kSamePlace * extent;
  };
  return !conditions.targets.empty() || !conditions.angles.empty() ||
         std::any_of(conditions.pins.begin(), conditions.pins.end(), moves);
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
  const double side = share_along(push_here(*erection), rods::joint_positions(state_));
  if (side < -kLeastSide) {
    remark = fmt::format(
        "the shape is on the other side of its plane than the designed one: deploy it to {:.4g} "
        "degrees and open it again from there",
        flat / kDegree);
  }
  return std::abs(side) <= kLeastSide;
}

/// The push, turned into the linkage's present plane.
std::vector<rods::JointLoad> LiveLinkage::push_here(const scene::LinkageErection& erection) const {
  std::vector<rods::JointLoad> push;
  for (const scene::JointLoad& load : erection.push) {
    push.push_back(
        {load.joint, load.force, load.moment / length_unit_, load.torque / length_unit_});
  }
  const bool has_flat = erection.flat_positions.cols() > 0;
  return rods::turned_push(push, has_flat ? erection.flat_positions : rods::joint_positions(drawn_),
                           rods::joint_positions(state_));
}

/// Describes a shape that was opened with an erection, or that was released. A jump to the mirror
/// image becomes an event of the path.
std::string LiveLinkage::describe_shape_reached(const scene::LinkageConditions& conditions,
                                                const rods::LinkageState& before,
                                                Outcome& outcome) const {
  const Eigen::Matrix3Xd joints = rods::joint_positions(state_);
  if (conditions.erection) {
    const scene::LinkageErection& erection = *conditions.erection;
    const bool opens = conditions.mean_angle &&
                       state_.mean_opening_angle() > before.mean_opening_angle() + kLeastOpening;
    if (opens && !erection.failure.empty())
      return "no way to open this design to its shape is known: " + erection.failure;
    std::string missed = describe_missed_shape(conditions, joints, extent_);
    if (!missed.empty()) return missed;
  }
  const Eigen::Matrix3Xd joints_before = rods::joint_positions(before);
  if (drives(conditions, joints_before, extent_) || !is_mirrored(joints_before, joints)) return {};
  if (outcome.path.empty()) return {};
  rods::BranchEvent& event = outcome.path.back().event;
  if (event == rods::BranchEvent::kNone) event = rods::BranchEvent::kJump;
  return "the structure jumped to the mirror image of the shape before";
}

/// In the stages of the erection, with its push times a factor.
LiveLinkage::Outcome LiveLinkage::open_with_push(const scene::LinkageConditions& conditions,
                                                 const rods::Conditions& target, double factor,
                                                 const JobContext& job,
                                                 const OnIterate& on_iterate) {
  std::vector<rods::JointLoad> push = push_here(*conditions.erection);
  for (rods::JointLoad& load : push) {
    load.force *= factor;
    load.moment *= factor;
    load.opening_torque *= factor;
  }
  std::optional<int> support;
  if (conditions.erection->support) support = conditions.erection->support->joint;
  const std::vector<rods::Conditions> stages = rods::erection_stages(state_, target, push, support);
  const double share = 1 / static_cast<double>(stages.size());
  Outcome opened;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    Outcome part;
    lead(stages[k], std::min(share_of_step(stages[k]), kPushStep), job, on_iterate, part);
    append_outcome(opened, std::move(part), static_cast<double>(k) * share, share);
    if (!opened.reached) break;
  }
  return opened;
}

/// @param remark  gets the remark on it
/// @returns false where it is not to be erected, or was not to be reached so: then it is where it
/// was, and the outcome is empty
bool LiveLinkage::erect(const scene::LinkageConditions& conditions, const rods::Conditions& target,
                        const JobContext& job, const OnIterate& on_iterate, Outcome& outcome,
                        std::string& remark) {
  if (!is_erected_by(conditions, target, remark)) return false;
  Outcome erected = open_with_push(conditions, target, 1, job, on_iterate);
  // Held elsewhere or loaded, a linkage may open to another branch: a stronger push may help.
  for (const double factor : {4.0, 16.0}) {
    if (!erected.reached ||
        describe_missed_shape(conditions, rods::joint_positions(state_), extent_).empty())
      break;
    const rods::LinkageState missed = state_;
    const rods::Conditions missed_held = held_;
    restore();
    Outcome again = open_with_push(conditions, target, factor, job, on_iterate);
    const bool is_cancelled = again.report.status == rods::EquilibriumStatus::kCancelled;
    if (again.reached || is_cancelled) {
      erected = std::move(again);
    } else {
      state_ = missed;
      held_ = missed_held;
    }
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
