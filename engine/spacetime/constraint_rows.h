#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "engine/reduced/kinematics.h"
#include "engine/spacetime/constraint_errors.h"
#include "engine/spacetime/lanes.h"
#include "engine/spacetime/problem.h"
#include "engine/spacetime/run_elimination.h"

namespace limber::spacetime {

/// Terms of one knot that stand together.
struct TermBlock {
  int knot = 0;
  int first = 0, count = 0;  // count > 0
};

/// Two terms of one row, at different knots.
struct TermPair {
  int first = 0, second = 0;  // knot of first < knot of second
};

/// u and, if requested, J of every row at some z. Unitless (body lengths, frames).
struct RowState {
  Eigen::VectorXd residual;  // target - u, one per row
  Lanes jacobian;            // lanes x terms: column t is d u_row(t) / d z at the term's knot
};

/// The axes of all position constraints and the coordinates of all keyframes in free frames, as
/// rows grouped by knot. They are sorted by frame; within it, positions by (id, axis), then
/// keyframes by (id, coordinate). A coordinate that no mode moves (a row of zeros in S) has no row:
/// its error is constant.
///
/// A term of a row is its part at one knot. A position and a coordinate are read at one knot: one
/// term. A mean velocity is (u(frame) - u(since)) / (frame - since): two terms at two knots, or one
/// term and a constant if an end holds one of the frames. Terms are ordered by knot; at a knot,
/// those of positions and velocities precede those of keyframes. Rows are ordered by their first
/// term. Without velocities, terms and rows are the same.
///
/// A soft row costs weight/2 residual^2. An exact row is a soft row with a large weight and a shift
/// of its target: weight/2 (residual + multiplier/weight)^2. This is the method of multipliers. It
/// is well defined also for infeasible or dependent constraints, and tends to the least-squares
/// answer if they contradict each other.
class ConstraintRows {
 public:
  /// @param mixing  S, R x r; empty: (I, 0)^T
  ConstraintRows(std::shared_ptr<const reduced::Kinematics> kinematics, Eigen::MatrixXd mixing,
                 int modes);

  /// Other modes of the same number; rebuild() must follow.
  void set_mixing(Eigen::MatrixXd mixing);

  /// Knots: the distinct free frames of the constraints, sorted. Multipliers of surviving exact
  /// rows are kept.
  void rebuild(const ConstraintSet& constraints, const FreeFrames& frames);
  /// Only the target of one constraint changed.
  void set_target(const PositionConstraint& constraint);
  void forget_multipliers();

  [[nodiscard]] const std::vector<int>& knots() const { return knots_; }
  [[nodiscard]] int count() const { return static_cast<int>(target_.size()); }
  [[nodiscard]] int term_count() const { return static_cast<int>(row_of_.size()); }
  [[nodiscard]] int first_term(int knot) const {
    return first_term_[static_cast<std::size_t>(knot)];
  }
  [[nodiscard]] int knot_of(int term) const { return knot_of_[static_cast<std::size_t>(term)]; }
  [[nodiscard]] int row_of(int term) const { return row_of_[static_cast<std::size_t>(term)]; }
  /// Rows of two terms, by their second one.
  [[nodiscard]] const std::vector<TermPair>& pairs() const { return pairs_; }
  [[nodiscard]] bool exact(int row) const { return exact_[static_cast<std::size_t>(row)] != 0; }
  [[nodiscard]] int exact_count() const { return exact_count_; }

  /// Terms of positions and velocities, by knot: the only ones whose Jacobians change with z.
  [[nodiscard]] const std::vector<TermBlock>& position_blocks() const { return position_blocks_; }
  /// Rows of positions and velocities, ascending, and for each term of position_blocks() in turn
  /// the place of its row among them.
  [[nodiscard]] const std::vector<int>& position_rows() const { return position_rows_; }
  [[nodiscard]] const std::vector<int>& position_places() const { return position_places_; }
  /// Terms of keyframes, one a row, by knot: linear in z.
  [[nodiscard]] const std::vector<TermBlock>& keyframe_blocks() const { return keyframe_blocks_; }
  /// Per knot w with J^T W J = w S^T S over the rows of its keyframes.
  [[nodiscard]] Eigen::VectorXd keyframe_weights() const;
  /// S, R x r; empty: (I, 0)^T.
  [[nodiscard]] const Eigen::MatrixXd& mixing() const { return mixing_; }

  /// Weights as the iteration sees them: scale() times gamma, or times the exact rows' penalty.
  [[nodiscard]] const Eigen::VectorXd& weight() const { return weight_; }
  /// Continuation: every weight times this, in (0, 1].
  void set_scale(double scale);
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] const Eigen::VectorXd& multiplier() const { return multiplier_; }
  void set_exact_weight(double weight);
  [[nodiscard]] double exact_weight() const { return exact_weight_; }
  /// Multipliers of exact rows <- m.
  void set_multipliers(const Eigen::VectorXd& m);

  enum class Jacobian { kNo, kYes };
  /// @param z  lanes x knots
  void evaluate(const Lanes& z, Jacobian jacobian, RowState& state) const;
  /// One symmetric modes x modes block per knot: sum over its terms of m_row d2 u / dz2.
  void curvature(const Lanes& z, const Eigen::VectorXd& m,
                 std::vector<Eigen::MatrixXd>& blocks) const;

  /// residual + multiplier / weight (the residual itself in soft rows).
  void shifted(const Eigen::VectorXd& residual, Eigen::VectorXd& out) const;
  /// Sum of weight/2 residual^2 over soft rows.
  [[nodiscard]] double soft_energy(const Eigen::VectorXd& residual) const;
  /// merit at z = 0, exact rows counted with weight 1: the scale that small energies are compared
  /// with.
  [[nodiscard]] double rest_energy() const;
  /// The minimised value: soft energy and the exact rows' weight/2 (residual +
  /// multiplier/weight)^2.
  [[nodiscard]] double merit(const Eigen::VectorXd& residual) const;

  /// How far each constraint is missed: the distance over its axes (body lengths), of a velocity
  /// their difference (body lengths per frame).
  struct Miss {
    double distance = 0;
    bool exact = false;
    bool velocity = false;
    ConstraintId id = 0;
  };
  [[nodiscard]] std::vector<Miss> misses(const Eigen::VectorXd& residual) const;
  /// How far each keyframe is missed: |S z - z-bar| (unitless).
  [[nodiscard]] std::vector<Miss> keyframe_misses(const Eigen::VectorXd& residual) const;
  [[nodiscard]] ConstraintErrors errors(const Eigen::VectorXd& residual) const;
  /// Positions that are missed by more than this [m], the worst first.
  [[nodiscard]] std::vector<ConstraintMiss> missed_positions(const Eigen::VectorXd& residual,
                                                             double soft, double exact) const;
  /// Energy of what no mode moves, part of soft_energy().
  [[nodiscard]] double idle_energy() const { return idle_energy_; }

  /// Constraints in pinned frames: constant residuals (unitless), with their weights.
  struct Fixed {
    Eigen::VectorXd residual, weight;  // infinite weight: exact
    std::vector<int> owner;            // per row which constraint's it is, counted from 0
  };
  [[nodiscard]] const Fixed& fixed() const { return fixed_; }

 private:
  /// A position or a velocity.
  struct Member {
    ConstraintId id;
    int row, term;  // the first of each, -1 before its first knot
    unsigned axes;
    Eigen::Vector3d constant;  // what a frame held by an end adds to u (unitless)
    bool velocity;
  };
  /// The part of a member at one knot: factor times u, one term per axis. Parallel to queries_.
  struct Part {
    int member;
    int term;  // first term
    double factor;
  };
  /// A keyframe's rows.
  struct Keyframe {
    ConstraintId id;
    int knot, row, term;           // the first of each
    std::vector<int> coordinates;  // of z-hat, one a row
    double idle = 0;               // |z-bar|^2 of the coordinates that no mode moves
    bool exact = false;
  };
  /// Data that rebuild() gathers before it fills the vectors.
  struct Gathered;
  /// The part of a constraint in one frame.
  struct Reading {
    const PositionConstraint* constraint;
    double factor;
  };
  [[nodiscard]] static std::vector<std::pair<int, double>> readings(
      const PositionConstraint& constraint, const FreeFrames& frames);
  void add_positions(const std::vector<Reading>& readings, Gathered& rows);
  void add_keyframes(const std::vector<const KeyframeConstraint*>& keyframes, Gathered& rows);
  void set_coordinates(const Lanes& z) const;
  /// Displacements of constraints in a frame that an end holds: z = 0 (unitless).
  [[nodiscard]] Eigen::Vector3d held_displacement(int frame, reduced::SiteId site) const;
  void rebuild_fixed();
  void refresh_weights();

  std::shared_ptr<const reduced::Kinematics> kinematics_;
  Eigen::MatrixXd mixing_;
  int modes_, lanes_;
  double length_;
  double exact_weight_ = 1e4;
  double scale_ = 1;
  std::vector<int> knots_, first_term_, knot_of_, row_of_;
  std::vector<TermPair> pairs_;
  std::vector<TermBlock> position_blocks_, keyframe_blocks_;
  std::vector<int> position_rows_, position_places_;
  std::vector<char> exact_;
  std::vector<Member> members_;
  std::vector<Part> parts_;
  std::vector<Keyframe> keyframes_;
  double idle_energy_ = 0;
  std::vector<reduced::SiteQuery> queries_;                      // columns: knots
  std::vector<reduced::SiteQuery> position_queries_;             // columns: position_blocks()
  Eigen::VectorXd target_, gamma_, weight_, multiplier_, rest_;  // rest_: u at z = 0
  int exact_count_ = 0;
  Fixed fixed_;
  /// A constraint whose value no unknown changes, and its readings.
  struct Pinned {
    PositionConstraint constraint;
    std::vector<std::pair<int, double>> readings;
  };
  std::vector<Pinned> pinned_;
  mutable Eigen::MatrixXd coordinates_, jacobian_;  // R x knots, 3q x R
  mutable Eigen::Matrix3Xd u_, pull_;
};

}  // namespace limber::spacetime
