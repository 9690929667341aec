#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/scene/linkage.h"

namespace limber::session {

/// The sizes of a linkage's rods that designs change.
struct RodSizes {
  /// Rest lengths of segments; those of their edges follow, unless there are `edges`.
  Eigen::VectorXd segments;
  /// Rest lengths of edges by their EdgeNumbers; empty: those of segments say them.
  Eigen::VectorXd edges = {};
  /// Scales of the segments' sections; empty: all 1.
  Eigen::VectorXd sections = {};

  [[nodiscard]] bool operator==(const RodSizes& other) const;
};

/// @param drawn  rest lengths of segments where the conditions name none
[[nodiscard]] RodSizes sizes_under(const scene::LinkageConditions& conditions,
                                   const Eigen::VectorXd& drawn, const rods::EdgeNumbers& numbers);

/// @throws Error as the model's setters
void set_sizes(rods::LinkageModel& model, const RodSizes& sizes);

/// Sizes between two of one model, at a share of their difference.
/// @param from  as the model has them
[[nodiscard]] RodSizes sizes_between(const rods::LinkageModel& model, const RodSizes& from,
                                     const RodSizes& to, double share);
/// Largest relative change of a length or of a section along the path.
[[nodiscard]] double largest_change(const rods::LinkageModel& model, const RodSizes& from,
                                    const RodSizes& to);

}  // namespace limber::session
