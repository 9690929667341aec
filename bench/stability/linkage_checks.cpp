#include "bench/stability/linkage_checks.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/support/dense.h"

namespace limber::bench::stability {

using namespace rods;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Noise of scaled eigenvalues by differences of gradients.
constexpr double kSpectralNoise = 1e-6;
// Added to scaled second derivatives, so that rigid motions of floating parts are no division by 0.
constexpr double kRegularisation = 1e-10;

/// Unknowns that conditions leave free.
std::vector<int> free_unknowns(const ReducedVariables& variables, const Conditions& conditions) {
  std::vector<char> held(static_cast<std::size_t>(variables.size()), 0);
  const auto hold = [&](int joint, int first, int count) {
    std::fill_n(held.begin() + variables.joint_begin(joint) + first, count, char{1});
  };
  for (const JointPin& pin : conditions.pins) {
    if (pin.hold != Hold::kAngle) hold(pin.joint, kJointPosition, 6);
    if (pin.hold != Hold::kMotion) hold(pin.joint, kJointAngle, 1);
  }
  for (const AngleSetting& angle : conditions.angles) hold(angle.joint, kJointAngle, 1);
  std::vector<int> free;
  for (int u = 0; u < variables.size(); ++u)
    if (held[static_cast<std::size_t>(u)] == 0) free.push_back(u);
  return free;
}

/// Which unknowns are lengths, the others are angles.
std::vector<char> lengths_of(const ReducedVariables& variables) {
  std::vector<char> is_length(static_cast<std::size_t>(variables.size()), 0);
  for (int s = 0; s < variables.segments(); ++s) {
    for (int v = 0; v <= variables.edges(s); ++v) {
      const int at = variables.position(s, v);
      if (at >= 0) std::fill_n(is_length.begin() + at, 3, char{1});
    }
  }
  for (int j = 0; j < variables.joints(); ++j) {
    const auto joint = is_length.begin() + variables.joint_begin(j);
    std::fill_n(joint + kJointPosition, 3, char{1});
    std::fill_n(joint + kJointLengthA, 2, char{1});
  }
  return is_length;
}

}  // namespace

Finding finding_of(const EquilibriumReport& report, const LinkageModel& model,
                   const LinkageState& state) {
  Finding finding;
  finding.claim = report.converged() ? Claim::kConverged : Claim::kNotConverged;
  finding.message = report.message;
  // The energy of an edge that is folded back is infinite; without convergence it may be so.
  finding.is_finite = !report.converged() || std::isfinite(report.potential());
  for (int s = 0; s < model.variables().segments(); ++s)
    for (int v = 0; v <= model.variables().edges(s); ++v)
      finding.is_finite = finding.is_finite && state.vertex(model, s, v).allFinite();
  return finding;
}

double minimum_error(const LinkageModel& model, const LinkageState& state,
                     const Conditions& conditions, double mean_moment, double elastic) {
  const ReducedVariables& variables = model.variables();
  const std::vector<int> free = free_unknowns(variables, conditions);
  const std::vector<char> is_length = lengths_of(variables);
  const double edge = model.edge_lengths().mean();
  LinkageAssembly assembly(model);
  VectorXd increment = VectorXd::Zero(variables.size());
  const auto at = [&](int unknown, double by) {
    increment[unknown] = by;
    LinkageState moved = state.moved(model, increment);
    increment[unknown] = 0;
    return moved;
  };
  const auto potential = [&](const LinkageState& shape) {
    double value = testing::total_potential(model, shape, conditions);
    for (const JointState<double>& joint : shape.joints())
      value -= mean_moment * joint.opening_angle;
    return value;
  };
  /// Gradient of the elastic energy and the springs, which balances all else.
  const auto gradient = [&](const LinkageState& shape) {
    VectorXd values(variables.size());
    (void)assembly.gradient(shape, values);
    for (const TargetSpring& spring : conditions.springs) {
      const int joint = std::get<JointPoint>(spring.at).joint;
      values.segment<3>(variables.joint_begin(joint)) +=
          spring.stiffness *
          (shape.joints()[static_cast<std::size_t>(joint)].position - spring.position);
    }
    return values;
  };
  const auto n = static_cast<Index>(free.size());
  VectorXd slope(n);
  MatrixXd hessian(n, n);
  for (Index i = 0; i < n; ++i) {
    const int u = free[static_cast<std::size_t>(i)];
    const double h = is_length[static_cast<std::size_t>(u)] != 0 ? 1e-4 * edge : 1e-4;
    const LinkageState ahead = at(u, h), behind = at(u, -h);
    slope[i] = (8 * (potential(ahead) - potential(behind)) -
                (potential(at(u, 2 * h)) - potential(at(u, -2 * h)))) /
               (12 * h);
    hessian.col(i) = (gradient(at(u, 0.1 * h)) - gradient(at(u, -0.1 * h)))(free) / (0.2 * h);
  }
  const VectorXd scale = hessian.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  MatrixXd scaled =
      scale.asDiagonal() * (0.5 * (hessian + hessian.transpose())) * scale.asDiagonal();
  VectorXd forces = scale.cwiseProduct(slope);
  if (conditions.mean_opening_angle) {
    // Held along the mean angle: no step there, and nothing to fall along.
    VectorXd mean = VectorXd::Zero(n);
    for (Index i = 0; i < n; ++i) {
      const int u = free[static_cast<std::size_t>(i)] - variables.joint_begin(0);
      if (u >= 0 && u % kJointUnknowns == kJointAngle) mean[i] = scale[i];
    }
    mean.normalize();
    forces -= mean.dot(forces) * mean;
    const VectorXd row = scaled * mean;
    scaled += -mean * row.transpose() - row * mean.transpose() +
              (mean.dot(row) + 1) * mean * mean.transpose();
  }
  const reference::SymmetricEigen eigen = reference::symmetric_eigen(scaled);
  if ((eigen.values.array() < -kSpectralNoise).any()) return 1;
  const VectorXd along = eigen.vectors.transpose() * forces;
  const double gain =
      0.5 * (along.array().square() / (eigen.values.array().abs() + kRegularisation)).sum();
  return std::sqrt(gain / elastic);
}

}  // namespace limber::bench::stability
