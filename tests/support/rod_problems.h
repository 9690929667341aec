#pragma once

#include <vector>

#include "tests/support/rod_equilibrium.h"
#include "tests/support/single_rod.h"

// Problems with known answers, for tests and for `limber-bench rods`. An end is clamped by holding
// an edge and is then in the middle of it; free and hinged ends are nodes.

namespace limber::testing {

inline constexpr auto kUsual = rods::BendingForm::kMaterialFrames;

/// What a problem gave against the known answer.
struct RodAnswer {
  double value = 0;
  double expected = 0;
  double error = 0;  // relative to the rod's length where it is a place, else to the expected value
  rods::RodReport report;
  Eigen::Matrix3Xd nodes = {};  // where one shape is the answer
};

/// Cantilever with tip load alpha = P L^2 / EI: tip deflection (over L).
/// @param slenderness  length over the height of a square section (decides about stretching)
[[nodiscard]] RodAnswer cantilever(int edges, double alpha, double deflection, double shortening,
                                   double slenderness = 1e4, rods::BendingForm form = kUsual);
/// The same in units of ours: modulus, length and height; unknowns of the equilibrium.
[[nodiscard]] rods::RodEquilibrium cantilever_shape(int edges, double alpha, double modulus,
                                                    double length, double height,
                                                    rods::BendingForm form = kUsual);

/// Rolled up into a circle by an end moment: where the tip comes to lie.
[[nodiscard]] RodAnswer roll_up(int edges, rods::BendingForm form = kUsual);

enum class Ends { kHinged, kClamped };
/// Compressed between its ends: height (over L).
[[nodiscard]] RodAnswer compressed(int edges, Ends ends, double span, double height,
                                   rods::BendingForm form = kUsual);

/// 45 degree bend of Bathe and Bolourchi: distance of the tip from the known place.
[[nodiscard]] RodAnswer forty_five_degree_bend(int edges, double force, double torsion_constant,
                                               const Eigen::Vector3d& tip,
                                               rods::BendingForm form = kUsual);

/// Localised helix: the largest angle with the axis.
[[nodiscard]] RodAnswer localised_helix(int edges, rods::BendingForm form = kUsual);

/// Twist [rad] at which a closed ring leaves its plane.
[[nodiscard]] RodAnswer ring_threshold(int edges, rods::BendingForm form = kUsual);

}  // namespace limber::testing
