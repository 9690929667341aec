#include "engine/spacetime/constraint_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "engine/base/error.h"

namespace limber::spacetime {

ConstraintRows::ConstraintRows(std::shared_ptr<const reduced::Kinematics> kinematics,
                               Eigen::MatrixXd mixing, int modes)
    : kinematics_(std::move(kinematics)),
      mixing_(std::move(mixing)),
      modes_(modes),
      lanes_(padded_lanes(modes)),
      length_(kinematics_->length()) {}

void ConstraintRows::rebuild(const std::map<ConstraintId, PositionConstraint>& constraints,
                             int first_free, int last_free) {
  std::map<std::pair<ConstraintId, int>, double> kept_multipliers;
  for (const Member& member : members_) {
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((member.axes >> axis & 1U) == 0) continue;
      if (exact(row)) kept_multipliers[{member.id, axis}] = multiplier_[row];
      ++row;
    }
  }
  std::vector<const PositionConstraint*> ordered;
  pinned_.clear();
  for (const auto& [id, constraint] : constraints) {
    const bool free = constraint.frame >= first_free && constraint.frame <= last_free;
    if (!free || !kinematics_->moves(constraint.site)) {
      pinned_.push_back(constraint);
    } else {
      ordered.push_back(&constraint);
    }
  }
  std::sort(ordered.begin(), ordered.end(), [](const auto* a, const auto* b) {
    return std::tie(a->frame, a->id) < std::tie(b->frame, b->id);
  });
  knots_.clear();
  first_row_.clear();
  knot_of_.clear();
  exact_.clear();
  members_.clear();
  queries_.clear();
  exact_count_ = 0;
  std::vector<double> targets, weights, multipliers;
  for (const PositionConstraint* constraint : ordered) {
    if (knots_.empty() || knots_.back() != constraint->frame) {
      knots_.push_back(constraint->frame);
      first_row_.push_back(static_cast<int>(targets.size()));
    }
    const int knot = static_cast<int>(knots_.size()) - 1;
    members_.push_back({constraint->id, knot, static_cast<int>(targets.size()), constraint->axes});
    queries_.push_back({constraint->site, knot});
    for (int axis = 0; axis < 3; ++axis) {
      if ((constraint->axes >> axis & 1U) == 0) continue;
      const bool is_exact = std::isinf(constraint->weight);
      const auto known = kept_multipliers.find({constraint->id, axis});
      knot_of_.push_back(knot);
      exact_.push_back(is_exact ? 1 : 0);
      exact_count_ += is_exact ? 1 : 0;
      targets.push_back(constraint->target[axis] / length_);
      weights.push_back(constraint->weight);
      multipliers.push_back(is_exact && known != kept_multipliers.end() ? known->second : 0.0);
    }
  }
  first_row_.push_back(static_cast<int>(targets.size()));
  const auto rows = static_cast<Eigen::Index>(targets.size());
  target_ = Eigen::Map<const Eigen::VectorXd>(targets.data(), rows);
  gamma_ = Eigen::Map<const Eigen::VectorXd>(weights.data(), rows);
  refresh_weights();
  multiplier_ = Eigen::Map<const Eigen::VectorXd>(multipliers.data(), rows);
  coordinates_.setZero(kinematics_->coordinate_count(), static_cast<Eigen::Index>(knots_.size()));
  RowState rest;
  evaluate(Lanes::Zero(lanes_, static_cast<Eigen::Index>(knots_.size())), Jacobian::kNo, rest);
  rest_ = target_ - rest.residual;
  rebuild_fixed();
}

void ConstraintRows::rebuild_fixed() {
  std::vector<int> frames;
  std::vector<reduced::SiteQuery> queries;
  for (const PositionConstraint& constraint : pinned_) {
    queries.push_back({constraint.site, static_cast<int>(frames.size())});
    frames.push_back(constraint.frame);
  }
  std::vector<double> residual, weight;
  fixed_.owner.clear();
  if (!frames.empty()) {
    const Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(kinematics_->coordinate_count(),
                                                       static_cast<Eigen::Index>(frames.size()));
    Eigen::Matrix3Xd u;
    kinematics_->evaluate(frames, rest, queries, u, nullptr);
    for (std::size_t i = 0; i < pinned_.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        if ((pinned_[i].axes >> axis & 1U) == 0) continue;
        residual.push_back((pinned_[i].target[axis] - u(axis, static_cast<Eigen::Index>(i))) /
                           length_);
        weight.push_back(pinned_[i].weight);
        fixed_.owner.push_back(static_cast<int>(i));
      }
    }
  }
  const auto rows = static_cast<Eigen::Index>(residual.size());
  fixed_.residual = Eigen::Map<const Eigen::VectorXd>(residual.data(), rows);
  fixed_.weight = Eigen::Map<const Eigen::VectorXd>(weight.data(), rows);
}

std::vector<ConstraintRows::Miss> ConstraintRows::misses(const Eigen::VectorXd& residual) const {
  std::vector<Miss> misses;
  for (const Member& member : members_) {
    const int rows = std::popcount(member.axes & 7U);
    misses.push_back({residual.segment(member.row, rows).norm(), exact(member.row)});
  }
  int owner = -1;
  for (Eigen::Index row = 0; row < fixed_.residual.size(); ++row) {
    if (fixed_.owner[static_cast<std::size_t>(row)] != owner) misses.emplace_back();
    owner = fixed_.owner[static_cast<std::size_t>(row)];
    Miss& miss = misses.back();
    miss.distance = std::hypot(miss.distance, fixed_.residual[row]);
    miss.exact = std::isinf(fixed_.weight[row]);
  }
  return misses;
}

void ConstraintRows::set_target(const PositionConstraint& constraint) {
  for (PositionConstraint& pinned : pinned_) {
    if (pinned.id != constraint.id) continue;
    pinned.target = constraint.target;
    rebuild_fixed();
    return;
  }
  const auto member = std::find_if(members_.begin(), members_.end(),
                                   [&](const Member& m) { return m.id == constraint.id; });
  LIMBER_DEMAND(member != members_.end());
  for (int axis = 0, row = member->row; axis < 3; ++axis) {
    if ((member->axes >> axis & 1U) != 0) target_[row++] = constraint.target[axis] / length_;
  }
}

void ConstraintRows::forget_multipliers() { multiplier_.setZero(); }

void ConstraintRows::refresh_weights() {
  weight_ = scale_ * gamma_;
  for (int row = 0; row < count(); ++row) {
    if (exact(row)) weight_[row] = scale_ * exact_weight_;
  }
}

void ConstraintRows::set_exact_weight(double weight) {
  exact_weight_ = weight;
  refresh_weights();
}

void ConstraintRows::set_scale(double scale) {
  scale_ = scale;
  refresh_weights();
}

void ConstraintRows::set_multipliers(const Eigen::VectorXd& m) {
  for (int row = 0; row < count(); ++row) {
    if (exact(row)) multiplier_[row] = m[row];
  }
}

void ConstraintRows::evaluate(const Lanes& z, Jacobian wanted, RowState& state) const {
  const bool with_jacobian = wanted == Jacobian::kYes;
  const bool mixed = mixing_.size() != 0;
  if (mixed) {
    coordinates_.noalias() = mixing_ * z.topRows(modes_);
  } else {
    coordinates_.topRows(modes_) = z.topRows(modes_);
  }
  kinematics_->evaluate(knots_, coordinates_, queries_, u_, with_jacobian ? &jacobian_ : nullptr);
  state.residual.resize(count());
  if (with_jacobian) {
    if (state.jacobian.rows() != lanes_ || state.jacobian.cols() != count()) {
      state.jacobian.setZero(lanes_, count());
    }
  }
  const double scale = 1 / length_;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& member = members_[i];
    const auto query = static_cast<Eigen::Index>(i);
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((member.axes >> axis & 1U) == 0) continue;
      state.residual[row] = target_[row] - scale * u_(axis, query);
      if (with_jacobian) {
        if (mixed) {
          state.jacobian.col(row).head(modes_).noalias() =
              scale * (mixing_.transpose() * jacobian_.row(3 * query + axis).transpose());
        } else {
          state.jacobian.col(row).head(modes_) =
              scale * jacobian_.row(3 * query + axis).head(modes_).transpose();
        }
      }
      ++row;
    }
  }
}

void ConstraintRows::curvature(const Lanes& z, const Eigen::VectorXd& m,
                               std::vector<Eigen::MatrixXd>& blocks) const {
  const bool mixed = mixing_.size() != 0;
  if (mixed) {
    coordinates_.noalias() = mixing_ * z.topRows(modes_);
  } else {
    coordinates_.topRows(modes_) = z.topRows(modes_);
  }
  pull_.setZero(3, static_cast<Eigen::Index>(members_.size()));
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& member = members_[i];
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((member.axes >> axis & 1U) == 0) continue;
      pull_(axis, static_cast<Eigen::Index>(i)) = m[row++] / length_;
    }
  }
  kinematics_->curvature(knots_, coordinates_, queries_, pull_, jacobian_);
  const Eigen::Index size = coordinates_.rows();
  blocks.resize(knots_.size());
  for (std::size_t knot = 0; knot < knots_.size(); ++knot) {
    const auto block = jacobian_.middleCols(size * static_cast<Eigen::Index>(knot), size);
    if (mixed) {
      blocks[knot].noalias() = mixing_.transpose() * (block * mixing_);
    } else {
      blocks[knot] = block.topLeftCorner(modes_, modes_);
    }
  }
}

void ConstraintRows::shifted(const Eigen::VectorXd& residual, Eigen::VectorXd& out) const {
  out = residual + multiplier_.cwiseQuotient(weight_);
}

double ConstraintRows::soft_energy(const Eigen::VectorXd& residual) const {
  double sum = 0;
  for (int row = 0; row < count(); ++row) {
    if (!exact(row)) sum += gamma_[row] * residual[row] * residual[row];
  }
  return 0.5 * sum;
}

double ConstraintRows::rest_energy() const {
  double sum = 0;
  for (int row = 0; row < count(); ++row) {
    const double residual = target_[row] - rest_[row];
    sum += (exact(row) ? 1.0 : gamma_[row]) * residual * residual;
  }
  return 0.5 * sum;
}

double ConstraintRows::merit(const Eigen::VectorXd& residual) const {
  double sum = 0;
  for (int row = 0; row < count(); ++row) {
    const double value = residual[row] + multiplier_[row] / weight_[row];
    sum += weight_[row] * value * value;
  }
  return 0.5 * sum;
}

}  // namespace limber::spacetime
