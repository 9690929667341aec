#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/equilibrium/unknown_scales.h"

namespace limber::rods::detail {

/// Descends to an equilibrium as in a medium that resists (the proximal point method; Rockafellar
/// 1976). Each step is the equilibrium with springs that pull every vertex back to where the step
/// began. The springs are as weak as lets a step move far enough and no farther. The potential
/// falls with every step, and the shape moves continuously through states that are unstable without
/// the medium.
///
/// It is used for released conditions. A reaction that fades as a load does not lead there: a state
/// that is stable while a place is held may be unstable under its force. It is also used for lost
/// branches.
class DampedDescent {
 public:
  struct Step {
    EquilibriumReport report;
    double turned = 0;    // [rad]
    bool jumped = false;  // farther than the strongest springs should let it
  };
  using OnStep = std::function<void(const Step& step, const LinkageState& state)>;
  /// Sees the reports of tries that were given up.
  using OnFailure = std::function<void(const EquilibriumReport&)>;
  /// Whether the descent may pass through a shape.
  using Allows = std::function<bool(const LinkageState&)>;

  /// @param conditions  to come into equilibrium under; positions and angles may be along a path
  /// @pre the equilibrium and its model outlive this
  DampedDescent(LinkageEquilibrium& equilibrium, Conditions conditions);

  /// Springs of the first step so stiff that they take these loads, one for each joint. Otherwise
  /// as stiff as segments are against bending.
  void take_over(const std::vector<JointLoad>& loads);

  enum class End { kThere, kStuck, kCancelled, kForbidden };
  /// @param state  becomes the last equilibrium in the medium: where this is there, nearly one
  /// without it
  /// @param options  of each step
  /// @param allows  none: all; at the first that it does not, the end is kForbidden
  End run(LinkageState& state, const EquilibriumOptions& options, const JobContext& context,
          const OnStep& on_step, const OnFailure& on_failure, const Allows& allows = {});

  /// Conditions under which the state is in equilibrium.
  [[nodiscard]] const Conditions& held() const { return held_; }
  /// Sum of the increments of the steps, in the reduced unknowns.
  [[nodiscard]] const Eigen::VectorXd& increment() const { return increment_; }

 private:
  void place_springs(const LinkageState& state);
  [[nodiscard]] double farthest(const LinkageState& state) const;

  LinkageEquilibrium& equilibrium_;
  const UnknownScales scales_;
  const Conditions bare_;
  Conditions held_;
  std::vector<TargetSpring> springs_;
  double stiffness_, least_;
  Eigen::VectorXd increment_;
};

}  // namespace limber::rods::detail
