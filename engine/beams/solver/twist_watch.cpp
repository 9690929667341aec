#include "engine/beams/solver/twist_watch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::beams::detail {

namespace {

double twist_of(const BeamStructure& structure, const BeamState& state, int element) {
  // Cables, and ends that may turn about the beam, bear no torque at any angle.
  const BeamElement& e = structure.model().elements[static_cast<std::size_t>(element)];
  if (e.kind == BeamKind::kCable || e.start_release.rotations[0] || e.finish_release.rotations[0])
    return 0;
  return twist_angle(structure.constants(element), structure.ends(state, element));
}

}  // namespace

ElementTwist most_twisted(const BeamStructure& structure, const BeamState& state) {
  ElementTwist most;
  for (int e = 0; e < structure.elements(); ++e) {
    const double angle = twist_of(structure, state, e);
    if (most.element < 0 || std::abs(angle) > std::abs(most.angle)) most = {e, angle};
  }
  return most;
}

TwistWatch::TwistWatch(const BeamStructure& structure, const BeamState& start)
    : structure_(structure), turns_(static_cast<std::size_t>(structure.elements()), 0) {
  for (int e = 0; e < structure.elements(); ++e) angle_.push_back(twist_of(structure, start, e));
}

void TwistWatch::look(const BeamState& state) {
  for (int e = 0; e < structure_.elements(); ++e) {
    const auto i = static_cast<std::size_t>(e);
    const double angle = twist_of(structure_, state, e), change = angle - angle_[i];
    if (std::abs(change) > std::numbers::pi) turns_[i] += change < 0 ? 1 : -1;
    angle_[i] = angle;
  }
}

std::optional<int> TwistWatch::slipped() const {
  const auto found =
      std::find_if(turns_.begin(), turns_.end(), [](int turns) { return turns != 0; });
  if (found == turns_.end()) return {};
  return static_cast<int>(found - turns_.begin());
}

}  // namespace limber::beams::detail
