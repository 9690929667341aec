#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <optional>
#include <vector>

#include "tests/support/dense.h"

#include "engine/spacetime/problem.h"
#include "engine/spacetime/run_elimination.h"
#include "tests/support/chain_kinematics.h"

namespace limber::spacetime {

using Real = long double;
using DenseMatrix = reference::LongMatrix;
using DenseVector = reference::LongVector;

/// What acts on a mode in a frame, from the frame before, the frame and the next: by the definition
/// of each form, in long double.
struct DenseForce {
  Real before = 0, centre = 0, next = 0;
};
inline DenseForce dense_force(const ModeDynamics& dynamics, Eigen::Index mode) {
  const Real d = dynamics.damping[mode], lambda = dynamics.stiffness[mode];
  if (dynamics.discretisation == Discretisation::kDifferences) return {1, -2 - d + lambda, 1 + d};
  // Rates s of z'' + d z' + lambda z = 0, of which z_i = e^(-s i) must cost nothing.
  const std::complex<Real> root = std::sqrt(std::complex<Real>(d * d / 4 - lambda, 0));
  const auto kept = [&](Real sign) { return std::exp(-(d / 2 + sign * root)); };
  const Real sum = (kept(1) + kept(-1)).real(), product = (kept(1) * kept(-1)).real();
  const Real of_constant = 1 - sum + product;
  const Real q = of_constant > 0 ? lambda / of_constant : 1;
  return {q * product, -q * sum, q};
}

/// Rows over z_0 and z_1 of a sampled mode whose squares are what the two cost: the inverse of
/// their covariance where white forces have always acted, times what smooth ones count more.
inline DenseMatrix dense_beginning(const ModeDynamics& dynamics, Eigen::Index mode) {
  const DenseForce force = dense_force(dynamics, mode);
  const Real kept = force.before / force.next, sum = -force.centre / force.next;
  DenseMatrix rows = DenseMatrix::Zero(2, 2);
  if (!(kept < 1)) return rows;
  const Real lambda = dynamics.stiffness[mode], tau = dynamics.smoothing;
  const Real smooth = std::sqrt(1 + tau * tau * (1 + kept - sum)) * force.next;
  // gamma_0 (1, c; c, 1) with the correlation c of neighbours: 1 / gamma_0 is zero where lambda is.
  const Real correlation = sum / (1 + kept);
  const Real variance = (1 + kept) / ((1 - kept) * ((1 + kept) * (1 + kept) - sum * sum));
  const Real apart = (1 - kept) * (1 + kept);  // 1 / (gamma_0 (1 - c^2))
  rows(0, 0) = lambda > 0 ? smooth / std::sqrt(variance) : 0;
  rows(1, 0) = -smooth * std::sqrt(apart) * correlation;
  rows(1, 1) = smooth * std::sqrt(apart);
  return rows;
}

/// The same of a cycle, in which every frame has a neighbour on either side.
inline DenseMatrix dense_cycle(const ModeDynamics& dynamics, Eigen::Index mode,
                               Eigen::Index frames) {
  const DenseForce force = dense_force(dynamics, mode);
  DenseMatrix plain = DenseMatrix::Zero(frames, frames);
  for (Eigen::Index i = 0; i < frames; ++i) {
    plain(i, (i + frames - 1) % frames) += force.before;
    plain(i, i) += force.centre;
    plain(i, (i + 1) % frames) += force.next;
  }
  DenseMatrix result(2 * frames, frames);
  result.topRows(frames) = plain;
  for (Eigen::Index i = 0; i < frames; ++i)
    result.row(frames + i) =
        Real{dynamics.smoothing} * (plain.row((i + 1) % frames) - plain.row(i));
  return result;
}

/// E_f = 1/2 |A z|^2 of one mode, columns are frames: forces, and tau times their differences, the
/// first and the last to no force; of sampled modes what their beginning costs.
inline DenseMatrix dense_forces(const ModeDynamics& dynamics, Eigen::Index mode,
                                Eigen::Index frames) {
  const DenseForce force = dense_force(dynamics, mode);
  DenseMatrix plain = DenseMatrix::Zero(frames - 2, frames);
  for (Eigen::Index i = 0; i < plain.rows(); ++i) {
    plain(i, i) = force.before;
    plain(i, i + 1) = force.centre;
    plain(i, i + 2) = force.next;
  }
  const Real tau = dynamics.smoothing;
  DenseMatrix result = DenseMatrix::Zero(2 * frames - 1, frames);
  result.topRows(frames - 2) = plain;
  result.middleRows(frames - 2, frames - 2) += tau * plain;
  result.middleRows(frames - 1, frames - 2) -= tau * plain;
  if (dynamics.discretisation == Discretisation::kSampled)
    result.bottomLeftCorner(2, 2) = dense_beginning(dynamics, mode);
  return result;
}

struct DenseAnswer {
  Eigen::MatrixXd z;  // r x N
  double energy = 0;  // E_f + sum gamma E_c over soft constraints
};

/// The optimum for linear kinematics from the optimality conditions of all z at once, in long
/// double: QR of [A; W^1/2 J] if all rows are soft (accurate to about cond(A) 1e-19), else one
/// dense system [H E^T; E 0] with H = A^T A + J^T W J of the soft rows and E the exact ones, which
/// must be independent (cond(A)^2 1e-19).
/// @param mixing  S, R x r; empty: (I, 0)^T
inline DenseAnswer dense_optimum(const testing::LinearKinematics& kinematics,
                                 const ModeDynamics& dynamics, const Timeline& timeline,
                                 const std::vector<PositionConstraint>& constraints,
                                 const std::vector<KeyframeConstraint>& keyframes = {},
                                 Eigen::MatrixXd mixing = {}) {
  const Eigen::Index modes = dynamics.stiffness.size(), frames = timeline.frame_count;
  const FreeFrames free_frames(timeline);
  const Eigen::Index first = free_frames.first(), last = free_frames.last();
  const Eigen::Index size = (last - first + 1) * modes;
  const auto forces_of = timeline.is_cyclic() ? dense_cycle : dense_forces;
  const Eigen::Index of_mode = forces_of(dynamics, 0, frames).rows();
  DenseMatrix force = DenseMatrix::Zero(of_mode * modes, size);
  for (Eigen::Index k = 0; k < modes; ++k) {
    const DenseMatrix rows = forces_of(dynamics, k, frames);
    for (Eigen::Index frame = first; frame <= last; ++frame)
      force.block(k * of_mode, (frame - first) * modes + k, of_mode, 1) = rows.col(frame);
  }
  std::vector<DenseVector> soft, exact;
  std::vector<Real> soft_target, exact_target, weights;
  if (mixing.size() == 0) mixing.setIdentity(kinematics.coordinate_count(), modes);
  const auto add_row = [&](int frame, std::optional<int> since,
                           const Eigen::RowVectorXd& over_modes, Real target, double weight) {
    DenseVector row = DenseVector::Zero(size);
    const Real span = since ? free_frames.within(frame - *since) : 1;
    if (frame >= first && frame <= last)
      row.segment((frame - first) * modes, modes) = over_modes.transpose().cast<Real>() / span;
    if (since && *since >= first && *since <= last)
      row.segment((*since - first) * modes, modes) = -over_modes.transpose().cast<Real>() / span;
    const bool hold = std::isinf(weight);
    (hold ? exact : soft).push_back(row);
    (hold ? exact_target : soft_target).push_back(target);
    if (!hold) weights.push_back(weight);
  };
  for (const PositionConstraint& constraint : constraints) {
    for (int axis = 0; axis < 3; ++axis) {
      if ((constraint.axes >> axis & 1U) == 0) continue;
      add_row(constraint.frame, constraint.since,
              kinematics.maps().row(3 * constraint.site + axis) * mixing / kinematics.length(),
              constraint.target[axis] / static_cast<Real>(kinematics.length()), constraint.weight);
    }
  }
  for (const KeyframeConstraint& keyframe : keyframes) {
    for (Eigen::Index c = 0; c < mixing.rows(); ++c)
      add_row(keyframe.frame, std::nullopt, mixing.row(c), keyframe.coordinates[c],
              keyframe.weight);
  }
  const auto held = static_cast<Eigen::Index>(exact.size());
  DenseMatrix system = DenseMatrix::Zero(size + held, size + held);
  DenseVector right = DenseVector::Zero(size + held);
  system.topLeftCorner(size, size) = force.transpose() * force;
  for (std::size_t i = 0; i < soft.size(); ++i) {
    system.topLeftCorner(size, size) += weights[i] * soft[i] * soft[i].transpose();
    right.head(size) += weights[i] * soft_target[i] * soft[i];
  }
  for (Eigen::Index i = 0; i < held; ++i) {
    const DenseVector& row = exact[static_cast<std::size_t>(i)];
    system.block(size + i, 0, 1, size) = row.transpose();
    system.block(0, size + i, size, 1) = row;
    right[size + i] = exact_target[static_cast<std::size_t>(i)];
  }
  DenseVector solution;
  if (held > 0) {
    solution = reference::solve_in_long_double(system, right);
  } else {
    const auto rows = static_cast<Eigen::Index>(soft.size());
    DenseMatrix stacked(force.rows() + rows, size);
    DenseVector wanted = DenseVector::Zero(stacked.rows());
    stacked.topRows(force.rows()) = force;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto at = static_cast<std::size_t>(i);
      stacked.row(force.rows() + i) = std::sqrt(weights[at]) * soft[at].transpose();
      wanted[force.rows() + i] = std::sqrt(weights[at]) * soft_target[at];
    }
    solution = reference::least_squares_in_long_double(stacked, wanted);
  }
  const DenseVector free = solution.head(size);
  DenseAnswer answer{Eigen::MatrixXd::Zero(modes, frames), 0};
  answer.z.middleCols(first, last - first + 1).reshaped() = free.cast<double>();
  Real energy = (force * free).squaredNorm() / 2;
  for (std::size_t i = 0; i < soft.size(); ++i) {
    const Real residual = soft_target[i] - soft[i].dot(free);
    energy += weights[i] * residual * residual / 2;
  }
  answer.energy = static_cast<double>(energy);
  return answer;
}

/// Constraints on all sites in turn, evenly over the frames between the ends, targets at random.
inline std::vector<PositionConstraint> linear_constraints(
    const testing::LinearKinematics& kinematics, int count, int frame_count, double weight,
    unsigned seed) {
  std::mt19937_64 generator(seed);
  std::vector<PositionConstraint> constraints;
  const int sites = static_cast<int>(kinematics.maps().rows() / 3);
  for (int i = 0; i < count; ++i) {
    PositionConstraint constraint;
    constraint.id = static_cast<ConstraintId>(i + 1);
    constraint.frame = 2 + (frame_count - 5) * (i + 1) / (count + 1);
    constraint.site = i % sites;
    constraint.weight = weight;
    for (auto& value : constraint.target)
      value = 0.5 * kinematics.length() * testing::uniform(generator);
    constraints.push_back(constraint);
  }
  return constraints;
}

}  // namespace limber::spacetime
