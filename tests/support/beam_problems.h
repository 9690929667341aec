#pragma once

#include <Eigen/Core>

#include "engine/beams/solver/equilibrium.h"

// Structures with known answers, for tests and for `limber-bench beams`.

namespace limber::testing {

/// What a problem gave against the known answer.
struct BeamAnswer {
  double error = 0;  // of a place over the beam's length, else relative
  beams::BeamReport report;
};

/// Elements along x in the plane of x and z; unit bending stiffnesses.
/// @param slenderness  length over the radius of gyration
[[nodiscard]] beams::BeamModel straight_beam(int elements, double length = 1,
                                             double slenderness = 1e3);

/// Cantilever with tip load alpha = P L^2 / EI: distance of the tip from the known place.
[[nodiscard]] beams::BeamModel cantilever_model(int elements, double alpha, double length = 1,
                                                double slenderness = 1e3);
[[nodiscard]] BeamAnswer beam_cantilever(int elements, double alpha, double deflection,
                                         double shortening,
                                         const beams::BeamSolveOptions& options = {});

/// A cantilever rolled up to a circle by an end moment: distance of the tip from the root.
[[nodiscard]] beams::BeamModel roll_up_model(int elements);
[[nodiscard]] BeamAnswer beam_roll_up(int elements, const beams::BeamSolveOptions& options = {});

enum class BeamEnds { kHinged, kClamped };
/// Compressed between its ends: height.
[[nodiscard]] beams::BeamModel compressed_model(int elements, BeamEnds ends, double span);
[[nodiscard]] BeamAnswer beam_compressed(int elements, BeamEnds ends, double span, double height,
                                         const beams::BeamSolveOptions& options = {});

/// 45 degree bend of Bathe and Bolourchi in its units: distance of the tip from the known place.
[[nodiscard]] beams::BeamModel bend_model(int elements, double force, double torsion_constant);
[[nodiscard]] BeamAnswer beam_bend(int elements, double force, double torsion_constant,
                                   const Eigen::Vector3d& tip,
                                   const beams::BeamSolveOptions& options = {});

enum class ArchMoves { kInItsPlane, kInSpace };
/// A sine of 16 elements, span 1, rise 0.05, clamped at both ends, with a force down at its crown.
[[nodiscard]] beams::BeamModel shallow_arch(double load, ArchMoves moves = ArchMoves::kInItsPlane);

/// A cantilever of 16 elements under an axial force; a small force selects the side. It buckles at
/// pi^2 / 4.
[[nodiscard]] beams::BeamModel pressed_cantilever(double load);

/// Supports by node: all six directions, or the three translations and spins given.
[[nodiscard]] beams::BeamSupport clamped(int node);

}  // namespace limber::testing
