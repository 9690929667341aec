#pragma once

#include <Eigen/Core>

#include "engine/base/random.h"
#include "engine/rods/solver/condensed_matrix.h"

namespace limber::rods::testing {

/// Hessians with the pattern of a linkage: a random matrix of 11 numbers at every interior vertex
/// of every chain, random terminal Jacobians and joint blocks.
/// @param negative  share of directions of negative curvature: 0 gives a positive definite matrix
inline void fill_randomly(CondensedMatrix& matrix, double negative, Random& random) {
  using Element = Eigen::Matrix<double, 11, 11>;
  const ChainBatches& structure = matrix.structure();
  const auto fill = [&](auto& values, double size) {
    for (Eigen::Index i = 0; i < values.size(); ++i) values.data()[i] = random.uniform(-size, size);
  };
  const auto curvature = [&] { return random.uniform() < negative ? -1.0 : 1.0; };
  matrix.set_zero();
  for (int c = 0; c < static_cast<int>(structure.chains().size()); ++c) {
    const int edges = structure.chains()[c].edges;
    for (int number = 0; number < 4 * edges + 3; ++number)
      matrix.entry(c, number, number) += 0.3 * curvature();
    for (int vertex = 1; vertex < edges; ++vertex) {
      Element half;
      fill(half, 1);
      Element scaled = half;
      for (int k = 0; k < 11; ++k) scaled.col(k) *= curvature();
      const Element element = scaled * half.transpose();
      for (int j = 0; j < 11; ++j) {
        for (int i = j; i < 11; ++i)
          matrix.entry(c, 4 * (vertex - 1) + i, 4 * (vertex - 1) + j) += element(i, j);
      }
    }
    const int joints[2] = {structure.chains()[c].start_joint, structure.chains()[c].finish_joint};
    for (const int end : {0, 1}) {
      if (joints[end] < 0) continue;
      Eigen::Matrix<double, 7, 9> jacobian;
      fill(jacobian, 1);
      matrix.set_terminal(c, end, jacobian);
    }
  }
  for (int j = 0; j < structure.joints(); ++j) {
    Eigen::Matrix<double, 9, 9> half;
    fill(half, 0.5);
    Eigen::Map<Eigen::Matrix<double, 9, 9>> block(matrix.joint(j));
    block = half * half.transpose();
    for (int k = 0; k < 9; ++k) block(k, k) += 0.3 * curvature();
  }
}

}  // namespace limber::rods::testing
