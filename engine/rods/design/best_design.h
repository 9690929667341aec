#pragma once

#include <optional>

#include "engine/rods/design/linkage_design.h"

namespace limber::rods::detail {

/// The best point of a search: one that keeps the constraints before one that does not, of those
/// that do the one of least objective, of the others the one that violates least.
class BestDesign {
 public:
  void clear() { point_.reset(); }
  /// @param violation  0 where both constraints hold
  void note(const DesignPoint& point, double objective, double violation) {
    if (point_ &&
        !(violation < violation_ || (violation == 0 && violation_ == 0 && objective < objective_)))
      return;
    point_ = point;
    objective_ = objective;
    violation_ = violation;
  }
  [[nodiscard]] const std::optional<DesignPoint>& point() const { return point_; }

 private:
  std::optional<DesignPoint> point_;
  double objective_ = 0, violation_ = 0;
};

}  // namespace limber::rods::detail
