#pragma once

#include <Eigen/Core>

#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams::detail {

/// How loads, motions and temporary loads come on, by a parameter s in [0, 1].
///
/// From the state as drawn, loads and motions grow with s and temporary loads fade with 1 - s. From
/// any other state loads are on at once, and what is held goes from where it is to where it shall
/// be: supports where they were drawn, motions at their end.
class LoadPath {
 public:
  LoadPath(const BeamStructure& structure, const BeamState& start, bool as_drawn);

  [[nodiscard]] NodeLoads loads(double s) const;

  /// Increments of all unknowns (free ones: zero) that bring held ones from a state to where they
  /// are at s.
  [[nodiscard]] Eigen::VectorXd held_increments(const BeamState& state, double s) const;

  /// Does anything change with s?
  [[nodiscard]] bool varies() const { return varies_; }
  /// Largest angle that a held node turns by from s = 0 to 1 [rad].
  [[nodiscard]] double turn() const;
  [[nodiscard]] bool nudged() const { return nudged_; }

 private:
  struct Held {
    int node = 0;
    Eigen::Vector3d from, to;        // positions
    std::array<bool, 3> axes{};      // of the node's axes: which components follow
    bool turns = false;              // all three spins follow
    Eigen::Quaterniond turned_from;  //
    Eigen::Vector3d rotation;        // rotation vector from there
  };

  const BeamStructure& structure_;
  NodeLoads loads_, temporary_;
  std::vector<Held> held_;
  bool as_drawn_ = true;
  bool varies_ = false;
  bool nudged_ = false;
};

}  // namespace limber::beams::detail
