#include "engine/spacetime/constraint_errors.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/spacetime/constraint_rows.h"

namespace limber::spacetime {

std::vector<ConstraintRows::Miss> ConstraintRows::misses(const Eigen::VectorXd& residual) const {
  std::vector<Miss> misses;
  for (const Member& member : members_) {
    const int rows = std::popcount(member.axes & 7U);
    misses.push_back(
        {residual.segment(member.row, rows).norm(), exact(member.row), member.velocity, member.id});
  }
  int owner = -1;
  for (Eigen::Index row = 0; row < fixed_.residual.size(); ++row) {
    if (fixed_.owner[static_cast<std::size_t>(row)] != owner) misses.emplace_back();
    owner = fixed_.owner[static_cast<std::size_t>(row)];
    Miss& miss = misses.back();
    miss.distance = std::hypot(miss.distance, fixed_.residual[row]);
    miss.exact = std::isinf(fixed_.weight[row]);
    miss.velocity = pinned_[static_cast<std::size_t>(owner)].constraint.is_velocity();
    miss.id = pinned_[static_cast<std::size_t>(owner)].constraint.id;
  }
  return misses;
}

std::vector<ConstraintRows::Miss> ConstraintRows::keyframe_misses(
    const Eigen::VectorXd& residual) const {
  std::vector<Miss> misses;
  for (const Keyframe& keyframe : keyframes_) {
    const auto rows = static_cast<Eigen::Index>(keyframe.coordinates.size());
    const double moved = residual.segment(keyframe.row, rows).squaredNorm();
    misses.push_back({std::sqrt(moved + keyframe.idle), keyframe.exact, false, 0});
  }
  return misses;
}

std::vector<ConstraintMiss> ConstraintRows::missed_positions(const Eigen::VectorXd& residual,
                                                             double soft, double exact) const {
  std::vector<ConstraintMiss> missed;
  for (const Miss& miss : misses(residual)) {
    const double distance = length_ * miss.distance;
    if (miss.velocity || distance <= (miss.exact ? exact : soft)) continue;
    missed.push_back({miss.id, distance, miss.exact});
  }
  std::stable_sort(missed.begin(), missed.end(),
                   [](const auto& a, const auto& b) { return a.distance > b.distance; });
  return missed;
}

ConstraintErrors ConstraintRows::errors(const Eigen::VectorXd& residual) const {
  ConstraintErrors errors;
  double squares = 0;
  int positions = 0;
  for (const Miss& miss : misses(residual)) {
    const double missed = length_ * miss.distance;
    double& largest = miss.velocity ? errors.max_velocity_error : errors.max_constraint_error;
    double& exact = miss.velocity ? errors.max_exact_velocity_error : errors.max_exact_error;
    largest = std::max(largest, missed);
    if (miss.exact) exact = std::max(exact, missed);
    if (miss.velocity) continue;
    squares += miss.distance * miss.distance;
    ++positions;
  }
  if (positions > 0) errors.rms_constraint_error = length_ * std::sqrt(squares / positions);
  for (const Miss& miss : keyframe_misses(residual))
    errors.max_keyframe_error = std::max(errors.max_keyframe_error, miss.distance);
  return errors;
}

}  // namespace limber::spacetime
