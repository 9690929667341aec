#pragma once

#include <functional>
#include <vector>

#include "engine/rods/equilibrium/linkage_equilibrium.h"

namespace limber::rods::detail {

/// What is held no longer is let go in a medium that resists: each step is the equilibrium with
/// springs that pull back to where the step began, weaker from step to step (the proximal point
/// method; Rockafellar 1976). The potential falls with every step, and where nothing holds the
/// shape any more it leaves it no faster than the medium lets it. A reaction that fades as a load
/// does neither: what is stable while a place is held need not be so under its force.
class LettingGo {
 public:
  /// @param released  what used to be held and was exerted by it, one load for each joint
  /// @param held      conditions without it, that the state agrees with
  /// @pre the model of the equilibrium outlives this
  LettingGo(LinkageEquilibrium& equilibrium, const std::vector<JointLoad>& released,
            Conditions held);

  struct Step {
    EquilibriumReport report;
    bool jumped = false;  // farther than the strongest springs should let it
  };
  using OnStep = std::function<void(const Step& step, const LinkageState& state)>;

  enum class End { kLetGo, kStuck, kCancelled };
  /// @param state     becomes the last equilibrium reached: nearly one under the conditions alone
  /// @param tolerance  of each step, see EquilibriumOptions
  /// @param on_failure  sees the reports of tries that were given up
  End run(LinkageState& state, const EquilibriumOptions& options, const JobContext& context,
          const OnStep& on_step, const std::function<void(const EquilibriumReport&)>& on_failure);

  /// What the state is in equilibrium under.
  [[nodiscard]] const Conditions& held() const { return held_; }

 private:
  void place_springs(const LinkageState& state);
  [[nodiscard]] double first_stiffness(const std::vector<JointLoad>& released) const;
  [[nodiscard]] double farthest(const LinkageState& state) const;

  LinkageEquilibrium& equilibrium_;
  Conditions bare_, held_;
  std::vector<TargetSpring> springs_;
  double extent_, stiffness_;
};

}  // namespace limber::rods::detail
