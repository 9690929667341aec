#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {

/// Two nodes of six, and at most five released rotations (twist only at one end).
inline constexpr int kMaxElementUnknowns = 18;

using LocalVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxElementUnknowns, 1>;
using LocalMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxElementUnknowns,
                                  kMaxElementUnknowns>;

/// Which unknowns of a structure an element sees.
struct ElementUnknowns {
  std::array<int, kMaxElementUnknowns> at{};  // start's six, finish's six, released ones
  int count = 12;
};
[[nodiscard]] ElementUnknowns unknowns_of(const BeamStructure& structure, int element);

[[nodiscard]] LocalVector local_gradient(const BeamStructure& structure, const BeamState& state,
                                         int element);
[[nodiscard]] LocalMatrix local_hessian(const BeamStructure& structure, const BeamState& state,
                                        int element,
                                        Compression compression = Compression::kCounts);

}  // namespace limber::beams
