#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <random>

#include "engine/rods/rod/rod_state.h"
#include "tests/support/rod_derivatives.h"

namespace limber::rods::testing {

inline constexpr auto k2008 = BendingForm::kMaterialFrames;

using LayoutPointer = std::shared_ptr<const RodLayout>;
using SourcePointer = std::shared_ptr<const SourceFrames>;

/// Rods with different stiffnesses about both axes, uneven rest lengths, curvatures and twists at
/// rest, at crooked unknowns.
struct Sample {
  LayoutPointer layout;
  RodParameters parameters;
  SourcePointer source;  // not at the unknowns: tangents some 20 degrees off
  Eigen::VectorXd unknowns;

  [[nodiscard]] RodState state() const { return {layout, source, unknowns}; }
  [[nodiscard]] RodAtSource at_source() const { return RodAtSource(state()); }
};

inline double uniform(std::mt19937& generator, double low, double high) {
  return low + (high - low) * (static_cast<double>(generator()) / 4294967296.0);
}

inline Eigen::VectorXd crooked(const RodLayout& layout, std::mt19937& generator, double roughness) {
  Eigen::VectorXd x(layout.unknowns());
  for (int r = 0; r < layout.rods(); ++r) {
    for (int i = 0; i <= layout.edges(r); ++i) {
      const int slot = layout.first_node(r) + i;
      x.segment<4>(4 * slot) << 1.0 * i, 2.0 * r, 0.2 * std::sin(i), 0.3 * i - 0.5;
      for (int c = 0; c < 4; ++c) x[4 * slot + c] += uniform(generator, -roughness, roughness);
      if (!layout.is_edge(slot)) x[4 * slot + 3] = 0;
    }
  }
  return x;
}

inline Sample sample(const std::vector<int>& edges, BendingForm form, unsigned seed = 7) {
  std::mt19937 generator(seed);
  const auto layout = std::make_shared<const RodLayout>(edges);
  RodParameters p(*layout);
  p.form = form;
  using P = RodParameters;
  for (int slot = 0; slot < layout->nodes(); ++slot) {
    if (layout->is_edge(slot)) {
      p(slot, P::kRestLength) = uniform(generator, 0.7, 1.3);
      p(slot, P::kStretching) = uniform(generator, 20, 40);
    }
    if (!layout->is_interior(slot)) continue;
    p(slot, P::kBending1) = uniform(generator, 3, 4);
    p(slot, P::kBending2) = uniform(generator, 0.5, 1);
    p(slot, P::kTorsion) = uniform(generator, 1, 2);
    for (int k = P::kRestBefore1; k <= P::kRestTwist; ++k)
      p(slot, static_cast<P::Parameter>(k)) = uniform(generator, -0.4, 0.4);
  }
  const Eigen::VectorXd before = crooked(*layout, generator, 0.15);
  const Eigen::VectorXd unknowns = crooked(*layout, generator, 0.15);
  const auto source = std::make_shared<const SourceFrames>(
      SourceFrames::without_twist(*layout, before, Eigen::Matrix3Xd::Zero(3, layout->rods())));
  return {layout, p, source, unknowns};
}

inline Eigen::MatrixXd dense(const RodLayout& layout, const HessianBlocks& blocks) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(layout.unknowns(), layout.unknowns());
  for_each_entry(layout, blocks, [&](int row, int column, double value) {
    result(row, column) += value;
    if (row != column) result(column, row) += value;
  });
  return result;
}

inline Eigen::VectorXd random_vector(Eigen::Index size, unsigned seed) {
  std::mt19937 generator(seed);
  Eigen::VectorXd result(size);
  for (auto& value : result) value = uniform(generator, -1, 1);
  return result;
}

/// The same rods moved rigidly: rotation by `omega` about the origin, then translation. Frames of
/// the source move along, so angles stay.
inline Eigen::VectorXd moved(const RodLayout& layout, const Eigen::VectorXd& unknowns,
                             const Eigen::Matrix3d& rotation, const Eigen::Vector3d& shift) {
  Eigen::VectorXd result = unknowns;
  for (int slot = 0; slot < layout.nodes(); ++slot)
    result.segment<3>(4 * slot) = rotation * unknowns.segment<3>(4 * slot) + shift;
  return result;
}

}  // namespace limber::rods::testing
