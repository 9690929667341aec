#pragma once

#include <string>

namespace limber::rods {

/// Weights of a design's objective. Larger ones than 1e30 overflow where they are multiplied, and
/// what is lost in rounding beside them is all else.
/// @throws Error{kInvalidArgument} with `field` for one outside [0, 1e30]
void demand_design_weight(const std::string& field, double weight);

}  // namespace limber::rods
