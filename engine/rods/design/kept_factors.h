#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/rods/design/design_variables.h"
#include "engine/rods/equilibrium/hessian_factor.h"
#include "engine/rods/linkage/linkage_model.h"

namespace limber::rods::detail {

/// The factors that certified both equilibria of the design that was found last, for derivatives
/// requested there. Memory of former factors is kept too, since it is large and used again.
class KeptFactors {
 public:
  struct Pair {
    std::unique_ptr<HessianFactor> flat, deployed;  // null: there is none
  };

  /// Null where there is none.
  [[nodiscard]] std::unique_ptr<HessianFactor> spare();
  /// Null is nothing.
  void give_back(std::unique_ptr<HessianFactor> factor);

  void keep(const DesignPoint& point, Pair factors);
  /// Those of a point, if it is the last one, number by number.
  [[nodiscard]] Pair take(const LinkageModel& model, const DesignPoint& point);

 private:
  std::optional<DesignPoint> point_;
  Pair factors_;
  std::vector<std::unique_ptr<HessianFactor>> spares_;
};

}  // namespace limber::rods::detail
