#pragma once

#include <functional>
#include <optional>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

/// The share of a load path up to which there is an equilibrium: the last load step that ended at
/// one. If a later step balances without being one (elements too long to resolve it, a mechanism,
/// loads under which it diverges), bisection follows.
class EquilibriumShare {
 public:
  /// @param s  in [0, 1], where `start` is an equilibrium of the path
  EquilibriumShare(double s, const BeamState& start) : s_(s), state_(start) {}

  enum class Verdict { kEquilibrium, kNone };
  /// Records a load step that ended at s, in the order of the path.
  void record(double s, const BeamState& state, Verdict verdict);

  /// Balances the state at s. @returns whether that is an equilibrium
  using Reach = std::function<bool(double s, BeamState& state)>;
  /// @param resolution  share to which the end is located, > 0
  [[nodiscard]] double locate(double resolution, const Reach& reach);

 private:
  double s_;
  BeamState state_;
  std::optional<double> first_beyond_;  // the first step since that was none
};

}  // namespace limber::beams::detail
