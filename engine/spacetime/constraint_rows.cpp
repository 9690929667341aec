#include "engine/spacetime/constraint_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "engine/base/error.h"
#include "engine/spacetime/material.h"

namespace limber::spacetime {

ConstraintRows::ConstraintRows(std::shared_ptr<const reduced::Kinematics> kinematics,
                               Eigen::MatrixXd mixing, int modes)
    : kinematics_(std::move(kinematics)),
      modes_(modes),
      lanes_(padded_lanes(modes)),
      length_(kinematics_->length()) {
  set_mixing(std::move(mixing));
}

/// Coordinates that nothing mixes are taken as they are, without products by one and zero.
void ConstraintRows::set_mixing(Eigen::MatrixXd mixing) {
  mixing_ = are_first_coordinates(mixing) ? Eigen::MatrixXd() : std::move(mixing);
}

/// Rows under way; multipliers are found again by what they belong to.
struct ConstraintRows::Gathered {
  enum class Kind { kPosition, kKeyframe };
  using Key = std::tuple<Kind, ConstraintId, int>;  // kind, id, axis or coordinate

  std::map<Key, double> known;  // multipliers of the exact rows before
  std::vector<double> targets, weights, multipliers;

  void add(const Key& key, double target, double weight) {
    const auto found = known.find(key);
    targets.push_back(target);
    weights.push_back(weight);
    multipliers.push_back(std::isinf(weight) && found != known.end() ? found->second : 0.0);
  }
};

void ConstraintRows::rebuild(const ConstraintSet& constraints, int first_free, int last_free) {
  Gathered rows;
  for (const Member& member : members_) {
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((member.axes >> axis & 1U) == 0) continue;
      if (exact(row)) rows.known[{Gathered::Kind::kPosition, member.id, axis}] = multiplier_[row];
      ++row;
    }
  }
  for (const Keyframe& keyframe : keyframes_) {
    int row = keyframe.row;
    for (const int coordinate : keyframe.coordinates) {
      if (exact(row))
        rows.known[{Gathered::Kind::kKeyframe, keyframe.id, coordinate}] = multiplier_[row];
      ++row;
    }
  }
  const auto is_free = [&](int frame) { return frame >= first_free && frame <= last_free; };
  std::map<int, std::vector<const PositionConstraint*>> positions;  // by frame, there by id
  std::map<int, std::vector<const KeyframeConstraint*>> keyframes;
  pinned_.clear();
  knots_.clear();
  for (const auto& [id, constraint] : constraints.positions) {
    if (!is_free(constraint.frame) || !kinematics_->moves(constraint.site)) {
      pinned_.push_back(constraint);
    } else {
      positions[constraint.frame].push_back(&constraint);
      knots_.push_back(constraint.frame);
    }
  }
  for (const auto& [id, keyframe] : constraints.keyframes) {
    if (!is_free(keyframe.frame)) continue;
    keyframes[keyframe.frame].push_back(&keyframe);
    knots_.push_back(keyframe.frame);
  }
  std::sort(knots_.begin(), knots_.end());
  knots_.erase(std::unique(knots_.begin(), knots_.end()), knots_.end());
  first_row_.clear();
  knot_of_.clear();
  members_.clear();
  keyframes_.clear();
  queries_.clear();
  position_queries_.clear();
  position_blocks_.clear();
  keyframe_blocks_.clear();
  position_count_ = 0;
  idle_energy_ = 0;
  for (const int frame : knots_) {
    const int knot = static_cast<int>(first_row_.size());
    const int first = static_cast<int>(rows.targets.size());
    first_row_.push_back(first);
    add_positions(positions[frame], rows);
    const int behind = static_cast<int>(rows.targets.size());
    if (behind > first) position_blocks_.push_back({knot, first, behind - first});
    position_count_ += behind - first;
    add_keyframes(keyframes[frame], rows);
    const int end = static_cast<int>(rows.targets.size());
    if (end > behind) keyframe_blocks_.push_back({knot, behind, end - behind});
    knot_of_.resize(rows.targets.size(), static_cast<int>(first_row_.size()) - 1);
  }
  first_row_.push_back(static_cast<int>(rows.targets.size()));
  const auto count = static_cast<Eigen::Index>(rows.targets.size());
  target_ = Eigen::Map<const Eigen::VectorXd>(rows.targets.data(), count);
  gamma_ = Eigen::Map<const Eigen::VectorXd>(rows.weights.data(), count);
  multiplier_ = Eigen::Map<const Eigen::VectorXd>(rows.multipliers.data(), count);
  exact_.clear();
  for (const double weight : rows.weights) exact_.push_back(std::isinf(weight) ? 1 : 0);
  exact_count_ = static_cast<int>(std::count(exact_.begin(), exact_.end(), 1));
  refresh_weights();
  coordinates_.setZero(kinematics_->coordinate_count(), static_cast<Eigen::Index>(knots_.size()));
  RowState rest;
  evaluate(Lanes::Zero(lanes_, static_cast<Eigen::Index>(knots_.size())), Jacobian::kNo, rest);
  rest_ = target_ - rest.residual;
  rebuild_fixed();
}

void ConstraintRows::add_positions(const std::vector<const PositionConstraint*>& positions,
                                   Gathered& rows) {
  const int knot = static_cast<int>(first_row_.size()) - 1;
  for (const PositionConstraint* constraint : positions) {
    members_.push_back(
        {constraint->id, knot, static_cast<int>(rows.targets.size()), constraint->axes});
    queries_.push_back({constraint->site, knot});
    position_queries_.push_back({constraint->site, static_cast<int>(position_blocks_.size())});
    for (int axis = 0; axis < 3; ++axis) {
      if ((constraint->axes >> axis & 1U) == 0) continue;
      rows.add({Gathered::Kind::kPosition, constraint->id, axis},
               constraint->target[axis] / length_, constraint->weight);
    }
  }
}

void ConstraintRows::add_keyframes(const std::vector<const KeyframeConstraint*>& keyframes,
                                   Gathered& rows) {
  const int knot = static_cast<int>(first_row_.size()) - 1;
  const bool mixed = mixing_.size() != 0;
  for (const KeyframeConstraint* constraint : keyframes) {
    Keyframe keyframe{constraint->id,
                      knot,
                      static_cast<int>(rows.targets.size()),
                      {},
                      0,
                      std::isinf(constraint->weight)};
    for (int c = 0; c < static_cast<int>(constraint->coordinates.size()); ++c) {
      const double target = constraint->coordinates[c];
      if (mixed ? mixing_.row(c).isZero(0) : c >= modes_) {
        keyframe.idle += target * target;
        continue;
      }
      keyframe.coordinates.push_back(c);
      rows.add({Gathered::Kind::kKeyframe, constraint->id, c}, target, constraint->weight);
    }
    if (!keyframe.exact) idle_energy_ += 0.5 * constraint->weight * keyframe.idle;
    keyframes_.push_back(std::move(keyframe));
  }
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

std::vector<ConstraintRows::Miss> ConstraintRows::keyframe_misses(
    const Eigen::VectorXd& residual) const {
  std::vector<Miss> misses;
  for (const Keyframe& keyframe : keyframes_) {
    const auto rows = static_cast<Eigen::Index>(keyframe.coordinates.size());
    const double moved = residual.segment(keyframe.row, rows).squaredNorm();
    misses.push_back({std::sqrt(moved + keyframe.idle), keyframe.exact});
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

Eigen::VectorXd ConstraintRows::keyframe_weights() const {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(knots_.size()));
  for (const Keyframe& keyframe : keyframes_) {
    if (!keyframe.coordinates.empty()) weights[keyframe.knot] += weight_[keyframe.row];
  }
  return weights;
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

void ConstraintRows::set_coordinates(const Lanes& z) const {
  if (mixing_.size() != 0) {
    coordinates_.noalias() = mixing_ * z.topRows(modes_);
  } else {
    coordinates_.topRows(modes_) = z.topRows(modes_);
  }
}

void ConstraintRows::evaluate(const Lanes& z, Jacobian wanted, RowState& state) const {
  const bool with_jacobian = wanted == Jacobian::kYes;
  const bool mixed = mixing_.size() != 0;
  set_coordinates(z);
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
  for (const Keyframe& keyframe : keyframes_) {
    int row = keyframe.row;
    for (const int c : keyframe.coordinates) {
      state.residual[row] = target_[row] - coordinates_(c, keyframe.knot);
      if (with_jacobian) {
        auto column = state.jacobian.col(row);
        column.setZero();
        if (mixed) {
          column.head(modes_) = mixing_.row(c).transpose();
        } else {
          column[c] = 1;
        }
      }
      ++row;
    }
  }
}

void ConstraintRows::curvature(const Lanes& z, const Eigen::VectorXd& m,
                               std::vector<Eigen::MatrixXd>& blocks) const {
  const bool mixed = mixing_.size() != 0;
  set_coordinates(z);
  pull_.setZero(3, static_cast<Eigen::Index>(members_.size()));
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& member = members_[i];
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((member.axes >> axis & 1U) == 0) continue;
      pull_(axis, static_cast<Eigen::Index>(i)) = m[row++] / length_;
    }
  }
  // Keyframes are linear: knots of theirs alone have no curvature.
  std::vector<int> frames;
  Eigen::MatrixXd at(coordinates_.rows(), static_cast<Eigen::Index>(position_blocks_.size()));
  for (const RowBlock& block : position_blocks_) {
    at.col(static_cast<Eigen::Index>(frames.size())) = coordinates_.col(block.knot);
    frames.push_back(knots_[static_cast<std::size_t>(block.knot)]);
  }
  kinematics_->curvature(frames, at, position_queries_, pull_, jacobian_);
  const Eigen::Index size = at.rows();
  blocks.resize(knots_.size());
  for (auto& block : blocks) block.setZero(modes_, modes_);
  for (std::size_t i = 0; i < position_blocks_.size(); ++i) {
    const auto found = jacobian_.middleCols(size * static_cast<Eigen::Index>(i), size);
    Eigen::MatrixXd& block = blocks[static_cast<std::size_t>(position_blocks_[i].knot)];
    if (mixed) {
      block.noalias() = mixing_.transpose() * (found * mixing_);
    } else {
      block = found.topLeftCorner(modes_, modes_);
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
  return 0.5 * sum + idle_energy_;
}

double ConstraintRows::rest_energy() const {
  double sum = 0;
  for (int row = 0; row < count(); ++row) {
    const double residual = target_[row] - rest_[row];
    sum += (exact(row) ? 1.0 : gamma_[row]) * residual * residual;
  }
  return 0.5 * sum + idle_energy_;
}

double ConstraintRows::merit(const Eigen::VectorXd& residual) const {
  double sum = 0;
  for (int row = 0; row < count(); ++row) {
    const double value = residual[row] + multiplier_[row] / weight_[row];
    sum += weight_[row] * value * value;
  }
  return 0.5 * sum + scale_ * idle_energy_;
}

}  // namespace limber::spacetime
