#include "engine/rods/design/design_text.h"

#include <fmt/format.h>

namespace limber::rods::detail {

std::string stuck_text(const DesignTrial& trial) {
  switch (trial.lost) {
    case LostShape::kFlat:
      return fmt::format(
          "the flat shape is about to buckle ({}), so no step is possible: take the best design, "
          "or start again with the guard from the start, a larger flat angle or thicker rods",
          trial.message);
    case LostShape::kDeployed:
      return fmt::format(
          "the deployed shape is about to snap to another one ({}), so no step is possible: take "
          "the best design, or start again with a smaller weight of distances, another mean angle, "
          "more joints or thinner rods",
          trial.message);
    case LostShape::kNone:
      break;
  }
  return fmt::format("no step is possible ({}): take the best design, or widen the bounds of sizes",
                     trial.message);
}

}  // namespace limber::rods::detail
