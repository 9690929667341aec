#pragma once

#include <Eigen/Core>

#include "engine/beams/solver/equilibrium.h"

// Straight columns under an end load, and a judge of stability that shares no code with the solver.

namespace limber::testing {

enum class ColumnEnds {
  kPinnedPinned,
  kClampedFree,
  kClampedPinned,
  kClampedGuided,   // the loaded end does not turn but moves aside
  kClampedClamped,  // it moves along the column only
};
[[nodiscard]] const char* to_string(ColumnEnds ends);

enum class Beside {
  kNothing,
  kSoftCantilever,  // not connected with the column, of stiffnesses ten thousand times smaller
};

struct Column {
  ColumnEnds ends = ColumnEnds::kClampedFree;
  int elements = 8;
  double load = 1;  // over Euler's
  Beside beside = Beside::kNothing;
};

/// 1 m along z, b x h = 20 x 10 mm, E = 1e10 Pa; nodes of the column come first.
[[nodiscard]] beams::BeamModel column_model(const Column& column);
/// Euler's load of the column [N].
[[nodiscard]] double euler_load(ColumnEnds ends);
/// How far the column is from the line that it was drawn on [m].
[[nodiscard]] double deflection(const Column& column, const beams::BeamState& state);
/// The largest deflection of the elastica at this load [m]; 0 below Euler's. Not for
/// kClampedPinned.
[[nodiscard]] double elastica_deflection(const Column& column);
/// Balanced, shortened and straight, whether that is stable or not.
[[nodiscard]] beams::BeamState straight_state(const Column& column);

/// Eigenvalues of the second derivatives of the energy by free unknowns, in order: differences of
/// forces, dense, scaled to a diagonal of ones, so that signs alone mean something.
[[nodiscard]] Eigen::VectorXd scaled_eigenvalues(const beams::BeamStructure& structure,
                                                 const beams::BeamState& state);
/// Those that are negative beyond what differences leave.
[[nodiscard]] int negative_by_differences(const beams::BeamStructure& structure,
                                          const beams::BeamState& state);

}  // namespace limber::testing
