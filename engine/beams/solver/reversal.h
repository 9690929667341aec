#pragma once

#include "engine/beams/solver/load_path.h"
#include "engine/beams/solver/newton.h"

namespace limber::beams::detail {

/// A balanced state at s of a load path.
struct PathPlace {
  const BeamState& state;
  double s;
};

/// Does the structure return to `from` where loads and motions are taken back from `to`, further
/// along the path? A snap releases energy at a constant load and does not reverse. Buckling does:
/// the buckled branch begins at the straight one with an amplitude of zero. A part without
/// stiffness at `from` also reverses, as a slack cable under its first load. States with the same
/// forces in every element are equal: members of a family of neutral equilibria, and mirror images.
/// @returns false, too, where Newton's method finds no balance on the path back
[[nodiscard]] bool reverses(const BeamStructure& structure, const LoadPath& path,
                            NewtonSolver& newton, const PathPlace& from, const PathPlace& to);

}  // namespace limber::beams::detail
