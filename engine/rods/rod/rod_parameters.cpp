#include "engine/rods/rod/rod_parameters.h"

#include <fmt/core.h>

#include <cmath>

#include "engine/base/error.h"

namespace limber::rods {

RodParameters::RodParameters(const RodLayout& layout)
    : values_(SlotArray::Zero(layout.rows(), kParameters)) {
  values_.col(kRestLength) = 1 - layout.activity().col(0).array();
}

RodParameters RodParameters::direction(const RodLayout& layout) {
  RodParameters result(layout);
  result.values_.setZero();
  return result;
}

void RodParameters::validate(const RodLayout& layout) const {
  constexpr const char* kNames[kParameters] = {
      "rest_length",   "stretching",    "bending_1",    "bending_2",    "torsion",
      "rest_before_1", "rest_before_2", "rest_after_1", "rest_after_2", "rest_twist"};
  for (int r = 0; r < layout.rods(); ++r) {
    for (int i = 0; i <= layout.edges(r); ++i) {
      const int slot = layout.first_node(r) + i;
      for (int p = 0; p < kParameters; ++p) {
        const bool of_edge = p <= kStretching;
        if (of_edge ? !layout.is_edge(slot) : !layout.is_interior(slot)) continue;
        const double value = values_(slot, p);
        const bool positive = p < kRestBefore1;
        if (std::isfinite(value) && (!positive || value > 0)) continue;
        throw Error(
            ErrorCode::kInvalidArgument,
            fmt::format("rods[{}].{}[{}].{}", r, of_edge ? "edges" : "vertices", i, kNames[p]),
            fmt::format("must be {}, got {}", positive ? "positive" : "finite", value));
      }
    }
  }
}

}  // namespace limber::rods
