#include "engine/beams/solver/equilibrium_share.h"

#include <utility>

namespace limber::beams::detail {

void EquilibriumShare::record(double s, const BeamState& state, Verdict verdict) {
  if (verdict == Verdict::kNone) {
    if (!first_beyond_) first_beyond_ = s;
    return;
  }
  s_ = s;
  state_ = state;
  first_beyond_.reset();
}

double EquilibriumShare::locate(double resolution, const Reach& reach) {
  while (first_beyond_ && *first_beyond_ - s_ > resolution) {
    const double middle = 0.5 * (s_ + *first_beyond_);
    BeamState trial = state_;
    if (reach(middle, trial)) {
      s_ = middle;
      state_ = std::move(trial);
    } else {
      first_beyond_ = middle;
    }
  }
  return s_;
}

}  // namespace limber::beams::detail
