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
/// Adds forces and moments on the twelve numbers of an element to the unknowns of the structure.
void add_to_unknowns(const BeamStructure& structure, const BeamState& state, int element,
                     const ElementVector& forces, Eigen::VectorXd& sum);

/// A load over an element: forces on its twelve numbers, and the second derivatives of its
/// potential.
struct LocalLoad {
  ElementVector forces;
  ElementMatrix hessian;
};
/// Second derivatives by the element's unknowns.
/// @param load  over the element; null: of the elastic energy alone
[[nodiscard]] LocalMatrix local_hessian(const BeamStructure& structure, const BeamState& state,
                                        int element, Compression compression = Compression::kCounts,
                                        const LocalLoad* load = nullptr);
/// A matrix by the element's twelve as one by its unknowns.
[[nodiscard]] LocalMatrix by_unknowns(const BeamStructure& structure, const BeamState& state,
                                      int element, const ElementMatrix& matrix);

}  // namespace limber::beams
