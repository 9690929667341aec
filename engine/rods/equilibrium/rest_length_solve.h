#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/rod/rod_state.h"

namespace limber::rods {

struct RestLengthOptions {
  int max_iterations = 100;  // Newton steps, > 0
  /// Unbalanced forces over the forces present, of unknowns and of rest lengths, and moments over
  /// moments, as EquilibriumOptions::tolerance; in (0, 1).
  double tolerance = 1e-8;
  /// Bounds on a segment's rest length as shares of its drawn length; 0 < shortest < 1 < longest.
  double shortest = 0.1;
  double longest = 10;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

enum class RestLengthStatus {
  kConverged,
  kIterationLimit,
  kStalled,    // no step, however small, lowered the energy
  kCancelled,  // by the caller; model and state are those of the last iterate
};

struct RestLengthReport {
  RestLengthStatus status = RestLengthStatus::kIterationLimit;
  int iterations = 0;
  int factorizations = 0;
  RodEnergies before;    // at the given shape with the given rest lengths
  RodEnergies energies;  // at the end
  double max_gradient_scaled = 0;
  std::vector<int> at_bound;  // segments whose rest length would exceed a bound
  std::string message;

  [[nodiscard]] bool converged() const { return status == RestLengthStatus::kConverged; }
};

/// Finds rest lengths with which a linkage holds the drawn shape with as little stress as it can.
/// It minimises the elastic energy E(x, L) over the rest lengths L of segments, between bounds, and
/// over all unknowns x but the positions of joints and of free ends. Those stay as in the given
/// state. Nothing regularises L: with the positions fixed a longer segment has to buckle.
///
/// The public X-Shells code does the same before it releases the linkage (its "closed" energies of
/// burd and darth_vader come out the same to 11 digits; linkages.json, restlen "solve"). An
/// equilibrium afterwards, without the fixed positions, is the caller's.
///
/// The method is Newton's on unknowns and lengths together (detail::LengthSystem), shifted where it
/// is indefinite, along second-order curves. Three steps are usual, of 0.01 s with 200 segments and
/// 0.3 s with 1500.
///
/// @param model  keeps the new lengths  @param state  the shape, keeps the new one
/// @throws Error as RestLengthOptions::validate, and {kInvalidArgument} with field lengths[s] where
/// the model's length of a segment is not within the bounds
RestLengthReport solve_rest_lengths(LinkageModel& model, LinkageState& state,
                                    const RestLengthOptions& options = {},
                                    const JobContext& context = {});

}  // namespace limber::rods
