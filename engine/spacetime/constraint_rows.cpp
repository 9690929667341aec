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

/// Rows being built; multipliers are found again by their constraint.
struct ConstraintRows::Gathered {
  enum class Kind { kPosition, kVelocity, kKeyframe };
  using Key = std::tuple<Kind, ConstraintId, int>;  // kind, id, axis or coordinate

  std::map<Key, double> known;  // multipliers of the exact rows before
  std::vector<double> targets, weights, multipliers;
  std::map<ConstraintId, int> members;  // those begun, where in members_

  void add(const Key& key, double target, double weight) {
    const auto found = known.find(key);
    targets.push_back(target);
    weights.push_back(weight);
    multipliers.push_back(std::isinf(weight) && found != known.end() ? found->second : 0.0);
  }
};

void ConstraintRows::rebuild(const ConstraintSet& constraints, const FreeFrames& frames) {
  Gathered rows;
  for (const Member& member : members_) {
    const auto kind = member.velocity ? Gathered::Kind::kVelocity : Gathered::Kind::kPosition;
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((member.axes >> axis & 1U) == 0) continue;
      if (exact(row)) rows.known[{kind, member.id, axis}] = multiplier_[row];
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
  std::map<int, std::vector<Reading>> positions;  // by frame, there by id
  std::map<int, std::vector<const KeyframeConstraint*>> keyframes;
  members_.clear();
  pinned_.clear();
  knots_.clear();
  for (const auto& [id, constraint] : constraints.positions) {
    auto read = readings(constraint, frames);
    const bool moves = kinematics_->moves(constraint.site) &&
                       std::any_of(read.begin(), read.end(),
                                   [&](const auto& at) { return frames.contains(at.first); });
    if (!moves) {
      pinned_.push_back({constraint, std::move(read)});
      continue;
    }
    rows.members[id] = static_cast<int>(members_.size());
    members_.push_back(
        {id, -1, -1, constraint.axes, Eigen::Vector3d::Zero(), constraint.is_velocity()});
    for (const auto& [frame, factor] : read) {
      if (frames.contains(frame)) {
        positions[frame].push_back({&constraint, factor});
        knots_.push_back(frame);
      } else {
        members_.back().constant += factor * held_displacement(frame, constraint.site);
      }
    }
  }
  for (const auto& [id, keyframe] : constraints.keyframes) {
    if (!frames.contains(keyframe.frame)) continue;
    keyframes[keyframe.frame].push_back(&keyframe);
    knots_.push_back(keyframe.frame);
  }
  std::sort(knots_.begin(), knots_.end());
  knots_.erase(std::unique(knots_.begin(), knots_.end()), knots_.end());
  first_term_.clear();
  knot_of_.clear();
  row_of_.clear();
  pairs_.clear();
  parts_.clear();
  keyframes_.clear();
  queries_.clear();
  position_queries_.clear();
  position_blocks_.clear();
  keyframe_blocks_.clear();
  position_rows_.clear();
  position_places_.clear();
  idle_energy_ = 0;
  for (const int frame : knots_) {
    const int knot = static_cast<int>(first_term_.size());
    const int first = term_count();
    first_term_.push_back(first);
    add_positions(positions[frame], rows);
    const int behind = term_count();
    if (behind > first) position_blocks_.push_back({knot, first, behind - first});
    add_keyframes(keyframes[frame], rows);
    const int end = term_count();
    if (end > behind) keyframe_blocks_.push_back({knot, behind, end - behind});
  }
  first_term_.push_back(term_count());
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

std::vector<std::pair<int, double>> ConstraintRows::readings(const PositionConstraint& constraint,
                                                             const FreeFrames& frames) {
  if (!constraint.since) return {{constraint.frame, 1.0}};
  int span = constraint.frame - *constraint.since;
  if (span < 0) span += frames.frame_count();  // over the seam of a cycle
  return {{*constraint.since, -1.0 / span}, {constraint.frame, 1.0 / span}};
}

void ConstraintRows::add_positions(const std::vector<Reading>& readings, Gathered& rows) {
  const int knot = static_cast<int>(first_term_.size()) - 1;
  for (const auto& [constraint, factor] : readings) {
    const int index = rows.members.at(constraint->id);
    Member& member = members_[static_cast<std::size_t>(index)];
    const bool begun = member.row >= 0;
    if (!begun) {
      member.row = static_cast<int>(rows.targets.size());
      member.term = term_count();
    }
    const auto kind = member.velocity ? Gathered::Kind::kVelocity : Gathered::Kind::kPosition;
    parts_.push_back({index, term_count(), factor});
    queries_.push_back({constraint->site, knot});
    position_queries_.push_back({constraint->site, static_cast<int>(position_blocks_.size())});
    for (int axis = 0, row = member.row; axis < 3; ++axis) {
      if ((constraint->axes >> axis & 1U) == 0) continue;
      if (!begun) {
        position_rows_.push_back(row);
        rows.add({kind, constraint->id, axis},
                 constraint->target[axis] / length_ - member.constant[axis], constraint->weight);
      }
      const auto at = std::lower_bound(position_rows_.begin(), position_rows_.end(), row);
      position_places_.push_back(static_cast<int>(at - position_rows_.begin()));
      if (begun) pairs_.push_back({member.term + row - member.row, term_count()});
      knot_of_.push_back(knot);
      row_of_.push_back(row++);
    }
  }
}

void ConstraintRows::add_keyframes(const std::vector<const KeyframeConstraint*>& keyframes,
                                   Gathered& rows) {
  const int knot = static_cast<int>(first_term_.size()) - 1;
  const bool mixed = mixing_.size() != 0;
  for (const KeyframeConstraint* constraint : keyframes) {
    Keyframe keyframe{constraint->id,
                      knot,
                      static_cast<int>(rows.targets.size()),
                      term_count(),
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
      knot_of_.push_back(knot);
      row_of_.push_back(static_cast<int>(rows.targets.size()));
      rows.add({Gathered::Kind::kKeyframe, constraint->id, c}, target, constraint->weight);
    }
    if (!keyframe.exact) idle_energy_ += 0.5 * constraint->weight * keyframe.idle;
    keyframes_.push_back(std::move(keyframe));
  }
}

Eigen::Vector3d ConstraintRows::held_displacement(int frame, reduced::SiteId site) const {
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(kinematics_->coordinate_count(), 1);
  const reduced::SiteQuery query{site, 0};
  Eigen::Matrix3Xd u;
  kinematics_->evaluate({&frame, 1}, rest, {&query, 1}, u, nullptr);
  return u.col(0) / length_;
}

void ConstraintRows::rebuild_fixed() {
  std::vector<double> residual, weight;
  fixed_.owner.clear();
  for (std::size_t i = 0; i < pinned_.size(); ++i) {
    const auto& [constraint, read] = pinned_[i];
    Eigen::Vector3d missed = constraint.target / length_;
    for (const auto& [frame, factor] : read)
      missed -= factor * held_displacement(frame, constraint.site);
    for (int axis = 0; axis < 3; ++axis) {
      if ((constraint.axes >> axis & 1U) == 0) continue;
      residual.push_back(missed[axis]);
      weight.push_back(constraint.weight);
      fixed_.owner.push_back(static_cast<int>(i));
    }
  }
  const auto rows = static_cast<Eigen::Index>(residual.size());
  fixed_.residual = Eigen::Map<const Eigen::VectorXd>(residual.data(), rows);
  fixed_.weight = Eigen::Map<const Eigen::VectorXd>(weight.data(), rows);
}

void ConstraintRows::set_target(const PositionConstraint& constraint) {
  for (Pinned& pinned : pinned_) {
    if (pinned.constraint.id != constraint.id) continue;
    pinned.constraint.target = constraint.target;
    rebuild_fixed();
    return;
  }
  const auto member = std::find_if(members_.begin(), members_.end(),
                                   [&](const Member& m) { return m.id == constraint.id; });
  LIMBER_DEMAND(member != members_.end());
  for (int axis = 0, row = member->row; axis < 3; ++axis) {
    if ((member->axes >> axis & 1U) == 0) continue;
    target_[row++] = constraint.target[axis] / length_ - member->constant[axis];
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

void ConstraintRows::evaluate(const Lanes& z, Jacobian jacobian, RowState& state) const {
  const bool with_jacobian = jacobian == Jacobian::kYes;
  const bool mixed = mixing_.size() != 0;
  set_coordinates(z);
  kinematics_->evaluate(knots_, coordinates_, queries_, u_, with_jacobian ? &jacobian_ : nullptr);
  state.residual = target_;
  if (with_jacobian) {
    if (state.jacobian.rows() != lanes_ || state.jacobian.cols() != term_count()) {
      state.jacobian.setZero(lanes_, term_count());
    }
  }
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    const unsigned axes = members_[static_cast<std::size_t>(part.member)].axes;
    const double scale = part.factor / length_;
    const auto query = static_cast<Eigen::Index>(i);
    for (int axis = 0, term = part.term; axis < 3; ++axis) {
      if ((axes >> axis & 1U) == 0) continue;
      state.residual[row_of(term)] -= scale * u_(axis, query);
      if (with_jacobian) {
        if (mixed) {
          state.jacobian.col(term).head(modes_).noalias() =
              scale * (mixing_.transpose() * jacobian_.row(3 * query + axis).transpose());
        } else {
          state.jacobian.col(term).head(modes_) =
              scale * jacobian_.row(3 * query + axis).head(modes_).transpose();
        }
      }
      ++term;
    }
  }
  for (const Keyframe& keyframe : keyframes_) {
    int row = keyframe.row, term = keyframe.term;
    for (const int c : keyframe.coordinates) {
      state.residual[row] -= coordinates_(c, keyframe.knot);
      if (with_jacobian) {
        auto column = state.jacobian.col(term);
        column.setZero();
        if (mixed) {
          column.head(modes_) = mixing_.row(c).transpose();
        } else {
          column[c] = 1;
        }
      }
      ++row;
      ++term;
    }
  }
}

void ConstraintRows::curvature(const Lanes& z, const Eigen::VectorXd& m,
                               std::vector<Eigen::MatrixXd>& blocks) const {
  const bool mixed = mixing_.size() != 0;
  set_coordinates(z);
  pull_.setZero(3, static_cast<Eigen::Index>(parts_.size()));
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    const unsigned axes = members_[static_cast<std::size_t>(part.member)].axes;
    for (int axis = 0, term = part.term; axis < 3; ++axis) {
      if ((axes >> axis & 1U) == 0) continue;
      pull_(axis, static_cast<Eigen::Index>(i)) = part.factor * m[row_of(term++)] / length_;
    }
  }
  // Keyframes are linear: knots of theirs alone have no curvature.
  std::vector<int> frames;
  Eigen::MatrixXd at(coordinates_.rows(), static_cast<Eigen::Index>(position_blocks_.size()));
  for (const TermBlock& block : position_blocks_) {
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
