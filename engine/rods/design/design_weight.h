#pragma once

#include <string>

namespace limber::rods {

/// Weights of a design's objective. Larger ones than 1e30 overflow in products, and everything
/// beside them is lost in rounding.
/// @throws Error{kInvalidArgument} with `field` for one outside [0, 1e30]
void demand_design_weight(const std::string& field, double weight);

}  // namespace limber::rods
