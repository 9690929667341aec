#pragma once

#include <Eigen/Core>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

/// Looks whether load steps go on as the one before went: what tells the branch that is followed
/// from another that Newton's method may land on.
class StepWatch {
 public:
  explicit StepWatch(const BeamStructure& structure) : structure_(structure) {}

  struct Verdict {
    double swerve = 0;  // from straight on; of a first step half of all it makes [rad]
    double turn = 0;    // of a node, or an element's chord, the largest [rad]
    int node = -1;      // where the swerve is
  };
  /// @param step  share of the way, > 0
  [[nodiscard]] Verdict look(const BeamState& from, const BeamState& to, double step) const;
  /// The step was taken: the next one is compared with it.
  void take(const BeamState& from, const BeamState& to, double step);
  /// The next one is a first step.
  void forget() { step_ = 0; }

 private:
  /// Translations of nodes, then rotation vectors of nodes and of released ends.
  [[nodiscard]] Eigen::Matrix3Xd change(const BeamState& from, const BeamState& to) const;
  [[nodiscard]] Verdict size_of(const Eigen::Matrix3Xd& change) const;

  const BeamStructure& structure_;
  Eigen::Matrix3Xd last_;
  double step_ = 0;  // 0: there is no last
};

}  // namespace limber::beams::detail
