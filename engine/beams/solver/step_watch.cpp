#include "engine/beams/solver/step_watch.h"

#include "engine/base/rotations/logarithm.h"

namespace limber::beams::detail {

namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

Eigen::Vector3d turn_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  return rotations::logarithm((to * from.conjugate()).normalized());
}

}  // namespace

Eigen::Matrix3Xd StepWatch::change(const BeamState& from, const BeamState& to) const {
  const int nodes = from.nodes(), hinges = static_cast<int>(from.hinge_turns.size());
  Eigen::Matrix3Xd change(3, 2 * nodes + hinges);
  change.leftCols(nodes) = to.positions - from.positions;
  for (int i = 0; i < nodes; ++i)
    change.col(nodes + i) = turn_between(from.rotations[index(i)], to.rotations[index(i)]);
  for (int i = 0; i < hinges; ++i)
    change.col(2 * nodes + i) = turn_between(from.hinge_turns[index(i)], to.hinge_turns[index(i)]);
  return change;
}

StepWatch::Verdict StepWatch::size_of(const Eigen::Matrix3Xd& change) const {
  Verdict most;
  const auto note = [&most](double size, int node) {
    if (size > most.turn) most = {0, size, node};
  };
  const int nodes = structure_.nodes();
  for (int i = 0; i < nodes; ++i) note(change.col(nodes + i).norm(), i);
  for (int e = 0; e < structure_.elements(); ++e) {
    const BeamElement& element = structure_.model().elements[index(e)];
    note((change.col(element.finish) - change.col(element.start)).norm() /
             structure_.constants(e).length,
         element.finish);
  }
  const auto& released = structure_.released_ends();
  for (std::size_t i = 0; i < released.size(); ++i)
    note(change.col(2 * nodes + static_cast<int>(i)).norm(), released[i].node);
  return most;
}

StepWatch::Verdict StepWatch::look(const BeamState& from, const BeamState& to, double step) const {
  const Eigen::Matrix3Xd made = change(from, to);
  Verdict verdict = size_of(made);
  if (step_ == 0) {
    verdict.swerve = 0.5 * verdict.turn;
    return verdict;
  }
  const Verdict aside = size_of(made - last_ * (step / step_));
  verdict.swerve = aside.turn;
  verdict.node = aside.node;
  return verdict;
}

void StepWatch::take(const BeamState& from, const BeamState& to, double step) {
  last_ = change(from, to);
  step_ = step;
}

}  // namespace limber::beams::detail
