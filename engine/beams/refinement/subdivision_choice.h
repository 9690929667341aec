#pragma once

#include "engine/beams/refinement/discretisation_error.h"

namespace limber::beams {

/// Into how many parts a structure's elements are cut.
struct BeamDiscretisation {
  /// Parts of every beam, >= 1 and <= kMaxParts; absent: as `tolerance` takes, 1 without one.
  std::optional<int> elements_per_member = {};
  /// Positions are to be off by at most this share of structure_size(), bending moments and
  /// utilisations by at most force_tolerance() of their largest ones, in (0, 0.1]. Beside
  /// elements_per_member it changes nothing, and results say whether it is met.
  std::optional<double> tolerance = {};
  /// Limit for cut models and for those that they are compared with, > 0.
  int max_elements = kMaxCutElements;

  static constexpr int kMaxParts = 64;
  static constexpr double kMaxTolerance = 0.1;

  /// Does the tolerance choose?
  [[nodiscard]] bool is_chosen() const { return tolerance && !elements_per_member; }
  /// Start of a structure.
  [[nodiscard]] Subdivision first(const BeamModel& model) const;
  /// @throws Error{kInvalidArgument} naming member, value and inequality
  void validate() const;
};

/// Halves the parts of elements that the error comes from: those of the largest indicators, which
/// have 95 % of their sum. @returns nothing where that exceeds the limits
[[nodiscard]] std::optional<Subdivision> refined_where_needed(const BeamModel& model,
                                                              const Subdivision& subdivision,
                                                              const std::vector<double>& indicators,
                                                              int max_elements);

/// Joins parts by twos if indicators predict an error below a quarter of the tolerance. They grow
/// by four when parts are twice as long. @returns nothing if that would not spare a fifth of the
/// elements
[[nodiscard]] std::optional<Subdivision> coarsened_where_possible(
    const BeamModel& model, const Subdivision& subdivision, const std::vector<double>& indicators,
    double error, double tolerance);

}  // namespace limber::beams
