#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/solver/held_rotation.h"
#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams::detail {

/// How loads, motions and temporary loads come on, by a parameter s in [0, 1].
///
/// Held nodes go from their present places to their targets: supports to where they were drawn,
/// motions to their end. Temporary loads fade with 1 - s.
class LoadPath {
 public:
  /// Loads grow with s, from the state as drawn.
  [[nodiscard]] static LoadPath from_drawn(const BeamStructure& structure);
  /// Loads are on at once, temporary ones never.
  [[nodiscard]] static LoadPath at_once(const BeamStructure& structure, const BeamState& start);
  /// Loads are on. The forces that keep the start in balance at s = 0 fade: loads from before, and
  /// reactions of removed supports.
  [[nodiscard]] static LoadPath following(const BeamStructure& structure, const BeamState& start,
                                          const std::vector<HeldTurn>& turned);

  /// All of it as it is at s.
  [[nodiscard]] LoadPath resting_at(double s) const;
  /// The same with temporary loads on to the end, from a start that has gone by common_move(), and
  /// from its end the path along which they fade.
  [[nodiscard]] LoadPath pushed() const;
  [[nodiscard]] LoadPath release() const;

  [[nodiscard]] LoadPath without_temporary_loads() const;

  [[nodiscard]] NodeLoads loads(double s) const;

  /// Increments of all unknowns (free ones: zero) that bring held ones from a state to where they
  /// are at s.
  [[nodiscard]] Eigen::VectorXd held_increments(const BeamState& state, double s) const;

  /// Are the loads at s = 0 below a share of those at s = 1? A moment counts as the force that has
  /// it over a length.
  [[nodiscard]] bool begins_unloaded(double share, double length) const;
  /// Does anything change with s?
  [[nodiscard]] bool varies() const { return varies_; }
  /// Largest angle that a held node turns by from s = 0 to 1 [rad].
  [[nodiscard]] double turn() const;
  /// The translation that comes closest to the motion of held nodes: no deformation, no preferred
  /// side.
  [[nodiscard]] Eigen::Vector3d common_move() const;
  [[nodiscard]] bool nudged() const { return nudged_; }
  /// Work of temporary loads, as they are at the start, from there to a state [force length]. It is
  /// relative to their work if all held nodes move alike. Below 0: the structure went to the other
  /// side.
  [[nodiscard]] double nudge_work(const BeamState& start, const BeamState& state) const;

 private:
  struct Held {
    int node = 0;
    Eigen::Vector3d from, to;    // positions
    std::array<bool, 3> axes{};  // of the node's axes: which components follow
    HeldRotation rotation;
  };
  LoadPath(const BeamStructure& structure, const BeamState& start,
           const std::vector<HeldTurn>& turned);

  const BeamStructure& structure_;
  NodeLoads first_, last_;  // at s = 0 and 1
  NodeLoads temporary_;     // where nudged_: part of first_
  std::vector<Held> held_;
  bool varies_ = false;
  bool nudged_ = false;
};

}  // namespace limber::beams::detail
