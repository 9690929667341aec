#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <vector>

#include "engine/reduced/kinematics.h"
#include "engine/spacetime/lanes.h"
#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// Rows of one knot that stand together.
struct RowBlock {
  int knot = 0;
  int first = 0, count = 0;  // count > 0
};

/// u and, if asked for, J of every row at some z. Unitless (body lengths).
struct RowState {
  Eigen::VectorXd residual;  // target - u, one per row
  Lanes jacobian;            // lanes x rows: column i is d u_i / d z at the row's knot
};

/// The axes of all position constraints and the coordinates of all keyframes in free frames as
/// rows: by frame, there positions by (id, axis), then keyframes by (id, coordinate), grouped by
/// knot. A coordinate that no mode moves (a row of zeros in S) is no row but a miss for good.
///
/// A soft row costs weight/2 residual^2. An exact row is a soft row with a large weight and a shift
/// of its target: weight/2 (residual + multiplier/weight)^2, the method of multipliers, which needs
/// neither feasible nor independent constraints to be well defined and tends to the least-squares
/// answer where they contradict each other.
class ConstraintRows {
 public:
  /// @param mixing  S, R x r; empty: (I, 0)^T
  ConstraintRows(std::shared_ptr<const reduced::Kinematics> kinematics, Eigen::MatrixXd mixing,
                 int modes);

  /// Other modes of the same number; rebuild() must follow.
  void set_mixing(Eigen::MatrixXd mixing);

  /// Knots: the distinct free frames of the constraints, sorted. Multipliers of surviving exact
  /// rows are kept.
  void rebuild(const ConstraintSet& constraints, int first_free, int last_free);
  /// Only the target of one constraint changed.
  void set_target(const PositionConstraint& constraint);
  void forget_multipliers();

  [[nodiscard]] const std::vector<int>& knots() const { return knots_; }
  [[nodiscard]] int count() const { return static_cast<int>(target_.size()); }
  [[nodiscard]] int first_row(int knot) const { return first_row_[static_cast<std::size_t>(knot)]; }
  [[nodiscard]] int knot_of(int row) const { return knot_of_[static_cast<std::size_t>(row)]; }
  [[nodiscard]] bool exact(int row) const { return exact_[static_cast<std::size_t>(row)] != 0; }
  [[nodiscard]] int exact_count() const { return exact_count_; }

  /// Rows of positions, by knot: the only ones whose Jacobians change with z.
  [[nodiscard]] const std::vector<RowBlock>& position_blocks() const { return position_blocks_; }
  [[nodiscard]] int position_count() const { return position_count_; }
  /// Rows of keyframes, by knot: linear in z.
  [[nodiscard]] const std::vector<RowBlock>& keyframe_blocks() const { return keyframe_blocks_; }
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
  void evaluate(const Lanes& z, Jacobian wanted, RowState& state) const;
  /// One symmetric modes x modes block per knot: sum over its rows of m_i d2 u_i / dz2.
  void curvature(const Lanes& z, const Eigen::VectorXd& m,
                 std::vector<Eigen::MatrixXd>& blocks) const;

  /// residual + multiplier / weight (the residual itself in soft rows).
  void shifted(const Eigen::VectorXd& residual, Eigen::VectorXd& out) const;
  /// Sum of weight/2 residual^2 over soft rows.
  [[nodiscard]] double soft_energy(const Eigen::VectorXd& residual) const;
  /// merit at z = 0, exact rows counted with weight 1: the scale that small energies are compared
  /// with.
  [[nodiscard]] double rest_energy() const;
  /// What is minimised: soft energy and the exact rows' weight/2 (residual + multiplier/weight)^2.
  [[nodiscard]] double merit(const Eigen::VectorXd& residual) const;

  /// How far each constraint is missed: the distance over its axes (unitless).
  struct Miss {
    double distance = 0;
    bool exact = false;
  };
  [[nodiscard]] std::vector<Miss> misses(const Eigen::VectorXd& residual) const;
  /// How far each keyframe is missed: |S z - z-bar| (unitless).
  [[nodiscard]] std::vector<Miss> keyframe_misses(const Eigen::VectorXd& residual) const;
  /// Energy of what no mode moves, part of soft_energy().
  [[nodiscard]] double idle_energy() const { return idle_energy_; }

  /// Constraints in pinned frames: residuals that nothing can change (unitless), with their
  /// weights.
  struct Fixed {
    Eigen::VectorXd residual, weight;  // infinite weight: exact
    std::vector<int> owner;            // per row which constraint's it is, counted from 0
  };
  [[nodiscard]] const Fixed& fixed() const { return fixed_; }

 private:
  struct Member {
    ConstraintId id;
    int knot, row;  // first row
    unsigned axes;
  };
  /// A keyframe's rows.
  struct Keyframe {
    ConstraintId id;
    int knot, row;                 // first row
    std::vector<int> coordinates;  // of z-hat, one a row
    double idle = 0;               // |z-bar|^2 of the coordinates that no mode moves
    bool exact = false;
  };
  /// What rebuild() gathers before it becomes vectors.
  struct Gathered;
  void add_positions(const std::vector<const PositionConstraint*>& positions, Gathered& rows);
  void add_keyframes(const std::vector<const KeyframeConstraint*>& keyframes, Gathered& rows);
  void set_coordinates(const Lanes& z) const;
  void rebuild_fixed();
  void refresh_weights();

  std::shared_ptr<const reduced::Kinematics> kinematics_;
  Eigen::MatrixXd mixing_;
  int modes_, lanes_;
  double length_;
  double exact_weight_ = 1e4;
  double scale_ = 1;
  std::vector<int> knots_, first_row_, knot_of_;
  std::vector<RowBlock> position_blocks_, keyframe_blocks_;
  int position_count_ = 0;
  std::vector<char> exact_;
  std::vector<Member> members_;
  std::vector<Keyframe> keyframes_;
  double idle_energy_ = 0;
  std::vector<reduced::SiteQuery> queries_;                      // columns: knots
  std::vector<reduced::SiteQuery> position_queries_;             // columns: position_blocks()
  Eigen::VectorXd target_, gamma_, weight_, multiplier_, rest_;  // rest_: u at z = 0
  int exact_count_ = 0;
  Fixed fixed_;
  std::vector<PositionConstraint> pinned_;
  mutable Eigen::MatrixXd coordinates_, jacobian_;  // R x knots, 3q x R
  mutable Eigen::Matrix3Xd u_, pull_;
};

}  // namespace limber::spacetime
