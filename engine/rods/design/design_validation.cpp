#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/rods/design/design_weight.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::rods {
namespace {

void refuse(const std::string& field, const char* rule, double value) {
  throw Error(ErrorCode::kInvalidArgument, field, fmt::format("must be {}, is {:g}", rule, value));
}

void demand_scale(const char* field, double value) {
  if (!(value >= 0) || !std::isfinite(value)) refuse(field, ">= 0 and finite", value);
}

}  // namespace

void demand_design_weight(const std::string& field, double weight) {
  constexpr double kMaxWeight = 1e30;  // largest weight that is accepted
  if (!(weight >= 0 && weight <= kMaxWeight)) refuse(field, "in [0, 1e30]", weight);
}

void DesignCriteria::validate() const {
  if (!(flat_share >= 0 && flat_share <= 1)) refuse("flat_share", "in [0, 1]", flat_share);
  demand_design_weight("distance_weight", distance_weight);
  demand_scale("energy_scale", energy_scale);
  demand_scale("length_scale", length_scale);
  demand_design_weight("surface_weight", surface_weight);
  demand_scale("least_area", least_area);
}

void DesignLimits::validate() const {
  if (!(largest_surprise > 0)) refuse("largest_surprise", "> 0", largest_surprise);
  if (!(largest_move > 0)) refuse("largest_move", "> 0", largest_move);
  if (!(surprise_share > 0)) refuse("surprise_share", "> 0", surprise_share);
  if (!(small_surprise >= 0)) refuse("small_surprise", ">= 0", small_surprise);
  try {
    equilibrium.validate();
  } catch (const Error& error) {
    throw Error(error.code(), "equilibrium." + error.field(), error.what());
  }
}

}  // namespace limber::rods
