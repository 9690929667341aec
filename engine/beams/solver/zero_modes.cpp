#include "engine/beams/solver/zero_modes.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numerics/dense.h"
#include "engine/base/random.h"

namespace limber::beams::detail {

namespace {

constexpr int kMaxInverseIterations = 40;
constexpr int kLeastInverseIterations = 4;
constexpr double kSettledChange = 1e-3;      // relative change of a value that has settled
constexpr double kFarBelowAllowance = 1e-2;  // of the allowance: settles no further
// Multiple of pure rounding: above it the material resists. Stresses take from an arch some 1e9
// times the rounding; a mechanism's motion leaves less than the rounding.
constexpr double kMaterialResists = 100;
constexpr double kOfNoMove = 1e-6;  // of the largest turn, times the extent: none at all

struct SoftMode {
  Eigen::VectorXd v;  // of unit norm by weights
  double value = 0;   // v^T K v
};

/// The softest direction orthogonal to `known` columns.
SoftMode softest_beside(const Eigen::MatrixXd& known, const Stiffness& stiffness,
                        const SparseCholesky& factor, const Eigen::VectorXd& weights,
                        const std::function<double(const Eigen::VectorXd&)>& allowance,
                        Random& random, const JobContext& context) {
  const auto clean = [&](Eigen::VectorXd& v) {
    for (int pass = 0; pass < 2 && known.cols() > 0; ++pass)
      v -= known * (known.transpose() * weights.cwiseProduct(v));
    v /= std::sqrt(v.dot(weights.cwiseProduct(v)));
  };
  SoftMode found;
  found.v.resize(stiffness.size());
  for (double& entry : found.v) entry = random.uniform() - 0.5;
  found.v = found.v.cwiseQuotient(weights.cwiseSqrt());
  clean(found.v);
  for (int i = 0; i < kMaxInverseIterations; ++i) {
    context.throw_if_cancelled();
    found.v = factor.solve(weights.cwiseProduct(found.v));
    clean(found.v);
    const double previous = found.value;
    found.value = found.v.dot(stiffness.times(found.v));
    if (i < kLeastInverseIterations) continue;
    if (std::abs(found.value - previous) < kSettledChange * std::abs(found.value)) break;
    if (std::abs(found.value) < kFarBelowAllowance * allowance(found.v)) break;
  }
  return found;
}

}  // namespace

SoftestModes softest_modes(const Stiffness& stiffness, const SparseCholesky& factor,
                           const Eigen::VectorXd& weights,
                           const std::function<double(const Eigen::VectorXd&)>& allowance,
                           const JobContext& context) {
  Random random(20);
  SoftestModes modes;
  modes.zero.resize(stiffness.size(), 0);
  const Eigen::Index most = std::min<Eigen::Index>(kMaxZeroModes, stiffness.size());
  while (true) {
    SoftMode found =
        softest_beside(modes.zero, stiffness, factor, weights, allowance, random, context);
    const bool vanishes = std::abs(found.value) < allowance(found.v);
    modes.next = std::move(found.v);
    modes.next_value = found.value;
    if (!vanishes) return modes;
    modes.zero.conservativeResize(Eigen::NoChange, modes.zero.cols() + 1);
    modes.zero.rightCols(1) = modes.next;
    if (modes.zero.cols() >= most) return modes;
  }
}

bool rolls_at_half_a_turn(const BeamStructure& structure, const BeamState& state,
                          const Eigen::VectorXd& direction) {
  const auto by_node = direction.head(6 * structure.nodes()).reshaped(6, structure.nodes());
  const double size = std::sqrt(
      (state.positions.rowwise().maxCoeff() - state.positions.rowwise().minCoeff()).squaredNorm());
  const double turn = by_node.bottomRows<3>().cwiseAbs().maxCoeff();
  if (by_node.topRows<3>().cwiseAbs().maxCoeff() > kOfNoMove * turn * size) return false;
  for (int i = 0; i < structure.nodes(); ++i) {
    if (by_node.col(i).tail<3>().norm() > kOfNoMove * turn &&
        structure.has_swung_by_half_a_turn(state, i))
      return true;
  }
  return false;
}

ZeroModes sorted_by_material(const Eigen::MatrixXd& zero, const Stiffness& material,
                             const Eigen::VectorXd& noise) {
  const Eigen::Index n = zero.cols();
  Eigen::MatrixXd resists(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    resists.col(i) = zero.transpose() * material.times(zero.col(i));
  const GeneralizedSymmetricEigen by_material(resists,
                                              zero.transpose() * noise.asDiagonal() * zero);
  if (!by_material.has_converged()) return {zero, Eigen::MatrixXd(zero.rows(), 0), {}};
  const Eigen::VectorXd& values = by_material.eigenvalues();
  const auto loose = (values.array() < kMaterialResists).count();
  const Eigen::MatrixXd directions = zero * by_material.eigenvectors();
  return {directions.leftCols(loose), directions.rightCols(n - loose), values.tail(n - loose)};
}

}  // namespace limber::beams::detail
