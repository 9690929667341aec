#pragma once

#include <Eigen/Core>
#include <vector>

#include "bench/suite.h"
#include "engine/beams/solver/equilibrium.h"

namespace limber::bench {

/// Evidence for places of nodes that another program calls an equilibrium. It does not report
/// rotations; those here balance at these places.
struct PlacesEvidence {
  /// Largest unbalanced force over the largest force present, moment over moment.
  double residual = 0;
  double energy = 0;        // elastic, at these places [force length]
  double moved = 0;         // largest distance of a node from there to the equilibrium next to it
  double energy_after = 0;  // of that equilibrium
  double apart = 0;         // largest distance from it to `near`
  const char* status = "";  // of the solve from the places
};
/// @param near  an equilibrium of the structure close by, whose rotations are the first guess
[[nodiscard]] PlacesEvidence examine_places(const beams::BeamStructure& structure,
                                            const Eigen::Matrix3Xd& places,
                                            const beams::BeamState& near);

/// The state of a structure with each element cut into equal parts (testing::refined), along cubic
/// curves through the nodes of a state that end as its elements do.
[[nodiscard]] beams::BeamState cut_state(const beams::BeamStructure& structure,
                                         const beams::BeamState& state, int parts);

/// The same structure cut ever finer, each time started from the shape of the one before.
struct CutEvidence {
  int parts = 0;
  double energy = 0;
  /// For the nodes that all have: distance from the shape cut less fine, largest and root mean
  /// square.
  double moved = 0, rms_moved = 0;
  Eigen::Matrix3Xd positions;   // of these nodes
  double largest_pressure = 0;  // of an element, over its buckling load when clamped at both ends
  const char* status = "";
};
/// @param state  an equilibrium of the model, uncut
[[nodiscard]] std::vector<CutEvidence> cut_finer(const beams::BeamModel& model,
                                                 const beams::BeamState& state, int most_parts);

}  // namespace limber::bench
