#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>

#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/design_rank.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::rods::detail {

/// One inequality g >= 0 in the augmented Lagrangian (Rockafellar 1973).
class AugmentedConstraint {
 public:
  [[nodiscard]] double force(double g) const { return std::max(0.0, multiplier_ - penalty_ * g); }
  [[nodiscard]] double value(double g) const {
    return (force(g) * force(g) - multiplier_ * multiplier_) / (2 * penalty_);
  }
  [[nodiscard]] double penalty() const { return penalty_; }
  /// Whichever is nearer to zero, g or the force over the penalty: both are >= 0 and one of them is
  /// 0 where nothing is left to be done.
  [[nodiscard]] double left(double g) const {
    return std::abs(std::min(g, multiplier_ / penalty_));
  }
  void update(double g);

 private:
  double multiplier_ = 0;
  double penalty_ = 10;
  double left_ = 0;  // at the last update
};

/// Extra weight of the flat energy beyond that of the objective, while a search needs it. Rest
/// lengths that press the flat linkage's rods make it buckle, and beyond that its equilibrium is
/// gone. With the guard up, the search keeps to lengths that fit a flat drawing; later it is
/// lowered.
class GuardWeight {
 public:
  [[nodiscard]] double weight() const { return weight_; }  // per energy
  /// Does it weigh enough beside the objective to keep that from falling? A guard that does not had
  /// better stay: without it the flat shape's rods press more and more, for next to no gain.
  // For this and the next: @param objective, flat_energy  where the search stands
  [[nodiscard]] bool hinders(double objective, double flat_energy) const;
  /// @returns whether it was of use so far: raised too often it is not
  bool raise(double objective, double flat_energy);
  /// To about a quarter of the objective.
  void raise_at_once(double objective, double flat_energy);
  void lower();

 private:
  double weight_ = 0;
  double first_ = 0;
  double last_ = 0;    // before it was lowered
  double kept_ = 0;    // after it was raised, over the objective there
  double fall_ = 0.5;  // of the weight when it is lowered; gentler after it had to be raised again
  int raised_ = 0;
  static constexpr int kAtOnce = 3;  // raises that raise_at_once() makes
};

/// Tells a violation that lessens slowly from one that nothing lessens.
class ViolationWatch {
 public:
  enum class Verdict {
    kFine,
    kRaise,     // not less by a hundredth after fifteen steps: multipliers ought to go up
    kHopeless,  // nor after these went up four times
  };
  /// @param violation  0 where constraints hold
  [[nodiscard]] Verdict see(double violation, int iteration);

 private:
  double least_ = std::numeric_limits<double>::infinity();
  int since_ = 0, raised_ = 0;
};

/// Merit that a search over rest lengths minimises: the objective, its constraints, and the guard.
class DesignMerit {
 public:
  DesignMerit(LinkageDesign& design, const DesignOptimizerOptions& options)
      : design_(design), options_(options) {}

  [[nodiscard]] double value(const DesignValues& values) const;
  // Gradient at the design's present point. @param values there
  [[nodiscard]] Eigen::VectorXd gradient(const DesignValues& values);
  [[nodiscard]] Eigen::VectorXd product(const DesignValues& values, const Eigen::VectorXd& v);

  /// For other criteria.
  void begin();
  [[nodiscard]] DesignRank rank(const DesignValues& values) const;
  /// Does each constraint either hold by itself, or lie at its bound under a force that it needs?
  [[nodiscard]] bool settled(const DesignValues& values) const;
  /// Root mean square height of the flat joints, share of the length scale.
  [[nodiscard]] double flat_height(const DesignValues& values) const;
  void update_multipliers(const DesignValues& values);
  [[nodiscard]] GuardWeight& guard() { return guard_; }

 private:
  /// All >= 0 where they hold; of the order of 1.
  [[nodiscard]] double flat_room(const DesignValues& values) const {
    return 1 - values.flatness / flatness_allowed();
  }
  [[nodiscard]] double angle_room(const DesignValues& values) const {
    return values.smallest_angle - options_.smallest_angle;
  }
  [[nodiscard]] double area_room(const DesignValues& values) const {
    return values.deployed_area / design_.criteria().least_area - 1;
  }
  [[nodiscard]] double least_room(const DesignValues& values) const;
  [[nodiscard]] double flatness_allowed() const;
  struct Forces {
    double flat, angle, area;  // >= 0, those of the constraints
    LinkageDesign::Which which;
  };
  [[nodiscard]] Forces forces(const DesignValues& values) const;
  [[nodiscard]] bool bounds_angle() const;
  [[nodiscard]] bool bounds_area() const { return design_.criteria().least_area > 0; }

  LinkageDesign& design_;
  const DesignOptimizerOptions& options_;
  AugmentedConstraint flat_, angle_, area_;
  GuardWeight guard_;
};

}  // namespace limber::rods::detail
