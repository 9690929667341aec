#include "engine/beams/solver/step_watch.h"

#include <algorithm>
#include <cmath>

#include "engine/base/index.h"
#include "engine/base/rotations/logarithm.h"

namespace limber::beams::detail {

namespace {

// Twice not smaller, in steps of a quarter each, will not get smaller; where it is, is known so
// well then.
constexpr double kSame = 0.75;
constexpr double kShortEnough = 1.0 / 256;  // of the path: longer steps are not judged as jumps
// Smaller shapes than the largest swerve turn over, too: close to where a structure buckles.
constexpr double kShortestBack = 1e-6;
constexpr double kSurprise = 0.5;  // of the motion that the step before predicts
constexpr double kBack = -0.5;     // cosine between the motions of two steps
constexpr double kClear = 2;       // of the largest swerve: less may be a bend that is steep

Eigen::Vector3d rotation_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  return rotations::logarithm((to * from.conjugate()).normalized());
}

/// Translations of nodes, then rotation vectors of nodes and of released ends.
Eigen::Matrix3Xd change_between(const BeamState& from, const BeamState& to) {
  const int nodes = from.nodes(), hinges = static_cast<int>(from.hinge_turns.size());
  Eigen::Matrix3Xd change(3, 2 * nodes + hinges);
  change.leftCols(nodes) = to.positions - from.positions;
  for (int i = 0; i < nodes; ++i)
    change.col(nodes + i) = rotation_between(from.rotations[index(i)], to.rotations[index(i)]);
  for (int i = 0; i < hinges; ++i)
    change.col(2 * nodes + i) =
        rotation_between(from.hinge_turns[index(i)], to.hinge_turns[index(i)]);
  return change;
}

Turn largest_turn(const BeamStructure& structure, const Eigen::Matrix3Xd& change) {
  Turn largest;
  const auto note = [&largest](double angle, int node) {
    if (angle > largest.angle) largest = {angle, node};
  };
  const int nodes = structure.nodes();
  for (int i = 0; i < nodes; ++i) note(change.col(nodes + i).norm(), i);
  for (int e = 0; e < structure.elements(); ++e) {
    const BeamElement& element = structure.model().elements[index(e)];
    note((change.col(element.finish) - change.col(element.start)).norm() /
             structure.constants(e).length,
         element.finish);
  }
  const auto& released = structure.released_ends();
  for (std::size_t i = 0; i < released.size(); ++i)
    note(change.col(2 * nodes + static_cast<int>(i)).norm(), released[i].node);
  return largest;
}

}  // namespace

Turn turn_between(const BeamStructure& structure, const BeamState& from, const BeamState& to) {
  return largest_turn(structure, change_between(from, to));
}

StepWatch::Verdict StepWatch::look(const Eigen::Matrix3Xd& made, double step) const {
  const Turn turn = largest_turn(structure_, made);
  if (step_ == 0) return {0.5 * turn.angle, turn.angle, turn.node};
  const Turn aside = largest_turn(structure_, made - last_ * (step / step_));
  return {aside.angle, turn.angle, aside.node};
}

StepWatch::Verdict StepWatch::look(const BeamState& from, const BeamState& to, double step) const {
  return look(change_between(from, to), step);
}

bool StepWatch::goes_back(const Eigen::Matrix3Xd& made, double step) const {
  if (step_ == 0 || step <= kShortestBack) return false;
  const Eigen::Index nodes = structure_.nodes(), turns = made.cols() - nodes;
  const auto now = made.rightCols(turns), before = last_.rightCols(turns);
  const double size = now.norm(), last = before.norm();
  return now.cwiseProduct(before).sum() < kBack * size * last && size > last * (step / step_);
}

bool StepWatch::is_jump(double step, double next) const {
  if (step <= shortest_) return true;
  const bool again = next <= too_far_at_ && verdict_.swerve > kSame * too_far_swerve_;
  return again && times_ >= 1 && step <= kShortEnough && verdict_.swerve > kClear * largest_;
}

bool StepWatch::surprises(const BeamState& from, const BeamState& to, double step) const {
  if (step_ == 0) return true;
  const Eigen::Matrix3Xd led = last_ * (step / step_);
  return largest_turn(structure_, change_between(from, to) - led).angle >
         kSurprise * largest_turn(structure_, led).angle;
}

void StepWatch::forget() {
  step_ = 0;
  too_far_at_ = 0;
  times_ = 0;
  factor_ = 2;
}

StepWatch::Judgement StepWatch::judge(const BeamState& from, const BeamState& to, double s,
                                      double next) {
  const double step = next - s;
  const Eigen::Matrix3Xd made = change_between(from, to);
  verdict_ = look(made, step);
  if (goes_back(made, step)) {
    factor_ = 0.25;
    return Judgement::kTooFar;
  }
  const double factor_to_limit = std::sqrt(0.5 * largest_ / std::max(verdict_.swerve, 1e-12));
  if (verdict_.swerve <= largest_) {
    last_ = made;
    step_ = step;
    // Steps do not grow beyond where one went too far, which may be many steps away.
    const double reach = (too_far_at_ - next) / step;
    factor_ = std::clamp(factor_to_limit, 0.5, reach > 0 ? std::clamp(reach, 1.0, 2.0) : 2.0);
    return Judgement::kContinues;
  }
  if (is_jump(step, next)) {
    forget();
    return Judgement::kJump;
  }
  const bool again = next <= too_far_at_ && verdict_.swerve > kSame * too_far_swerve_;
  times_ = again ? times_ + 1 : 0;
  too_far_at_ = next;
  too_far_swerve_ = verdict_.swerve;
  factor_ = again ? 0.25 : std::clamp(factor_to_limit, 0.1, 0.5);
  return Judgement::kTooFar;
}

}  // namespace limber::beams::detail
