#pragma once

#include "engine/rods/design/linkage_design.h"

namespace limber::rods {

/// Distance between two designs of one linkage, e.g. the results of searches from two starts.
struct DesignDifference {
  double lengths = 0;   // largest difference of a rest length or of a section, as a share of it
  double flat = 0;      // root mean square distance of joints between the flat shapes [length]
  double deployed = 0;  // and between the deployed ones

  /// Are they one design, up to a share of rest lengths and of the linkage's size?
  [[nodiscard]] bool same(double size, double tolerance = 1e-3) const {
    return lengths <= tolerance && flat <= tolerance * size && deployed <= tolerance * size;
  }
};

/// Shapes are compared as they stand in space: both must be held alike.
/// @pre points of the same linkage
[[nodiscard]] DesignDifference compare_designs(const DesignPoint& a, const DesignPoint& b);

}  // namespace limber::rods
