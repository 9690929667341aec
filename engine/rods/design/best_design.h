#pragma once

#include <optional>

#include "engine/rods/design/design_rank.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::rods::detail {

/// The first point of a search that no other one comes before.
class BestDesign {
 public:
  void clear() { point_.reset(); }
  void note(const DesignPoint& point, const DesignRank& rank) {
    if (point_ && !rank.before(rank_)) return;
    point_ = point;
    rank_ = rank;
  }
  [[nodiscard]] const std::optional<DesignPoint>& point() const { return point_; }

 private:
  std::optional<DesignPoint> point_;
  DesignRank rank_;
};

}  // namespace limber::rods::detail
