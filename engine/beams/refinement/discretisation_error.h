#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/structure/subdivision.h"

namespace limber::beams {

/// Tolerance of moments and utilisations for a tolerance of positions, as a share of the largest
/// ones: the same, but never less than 1 %. They are derivatives, whose errors fall by less for
/// each cut.
[[nodiscard]] inline double force_tolerance(double tolerance) { return std::max(tolerance, 0.01); }

/// Error of an equilibrium against the limit of ever more parts of its elements, if the structure
/// is as drawn: straight between nodes. See NOTATION.md, "Discretisation error".
struct DiscretisationError {
  /// False: the message says why. Errors of the compared equilibria are given even so if
  /// `compared_elements` is known, but cables that sag are part of the structure.
  bool is_known = false;
  /// Largest distance of a node of the structure from its place in the limit: over structure_size()
  /// and in [length]; which node that is.
  double position_error = 0;
  double max_distance = 0;
  int worst_node = -1;
  double energy_error = 0;  // of the elastic energy, relative
  /// Largest error of a bending moment along an element: over the structure's largest bending
  /// moment (over its largest axial force times the radius of gyration, where that is more), in
  /// [force length], and the element.
  double moment_error = 0;
  double max_moment_error = 0;
  int worst_moment_element = -1;
  /// Largest error of an element's utilisation over the structure's largest utilisation, and the
  /// element; absent where no yield stress is known.
  std::optional<double> utilisation_error;
  int worst_utilisation_element = -1;
  int elements = 0;           // of the equilibrium
  int compared_elements = 0;  // of the finest one it was compared with
  /// By which power of the parts' length the distances fell from halves to quarters, in [0, 4];
  /// 0: quarters were not needed.
  double order = 0;
  std::string message;  // doubts about the estimate; empty: none

  /// The largest error, those of moments and utilisations in proportion to force_tolerance().
  [[nodiscard]] double error_against(double tolerance) const {
    const double of_forces = std::max(moment_error, utilisation_error.value_or(0));
    return std::max(position_error, of_forces * tolerance / force_tolerance(tolerance));
  }
};

/// One equilibrium of a structure whose elements are cut.
struct CutEquilibrium {
  Subdivision subdivision;
  BeamState state;  // of the cut model
};

/// Intermediate results of the estimate.
struct DiscretisationEstimate {
  DiscretisationError error;
  /// Per element of the structure: energy of the difference between its forces and those of its
  /// halves, the root [sqrt(force length)].
  std::vector<double> indicators;
  /// The finest equilibrium that was found.
  std::optional<CutEquilibrium> finest;
};

/// Distances that halves find above this share of the structure's size are looked at in quarters,
/// and errors of moments and utilisations above the force_tolerance() of it.
inline constexpr double kSmallDiscretisationError = 1e-3;

/// Elements of a cut model, unless another number is requested.
inline constexpr int kMaxCutElements = 20000;

/// Diagonal of the box around the nodes as drawn that elements use [length].
[[nodiscard]] double structure_size(const BeamModel& model);

/// Each part is halved, and the equilibrium next to the shape that the halves begin with is found.
/// If nodes have moved far, the same is done with quarters, which give the order of the
/// differences. Otherwise order two is assumed, the least there is: distances then count for a
/// third more.
/// @param model  the structure, not cut
/// @param cut  its equilibrium, of cut_model(model, cut.subdivision)
/// @param max_elements  of the finest one that is compared with; where halves have more, there is
/// no estimate
/// @throws Error{kCancelled}
[[nodiscard]] DiscretisationEstimate estimate_discretisation(const BeamModel& model,
                                                             const CutEquilibrium& cut,
                                                             int max_elements = kMaxCutElements,
                                                             const JobContext& job = {});

}  // namespace limber::beams
