#pragma once

#include <numbers>
#include <optional>
#include <vector>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

/// From here on an element may let a whole turn slip through: its torque grows by little, then
/// falls [rad].
inline constexpr double kMaxTwistRad = 2 * std::numbers::pi / 3;

struct ElementTwist {
  int element = -1;  // -1: there are no beams
  double angle = 0;  // of its finish against its start [rad]
};
/// The element whose twist has the largest size.
[[nodiscard]] ElementTwist most_twisted(const BeamStructure& structure, const BeamState& state);

/// Counts the turns of elements' ends against each other from state to state: attitudes do not show
/// that one has slipped through.
class TwistWatch {
 public:
  TwistWatch(const BeamStructure& structure, const BeamState& start);

  /// @param state  no element's twist is by half a turn or more from that of the state before
  void look(const BeamState& state);
  /// An element through which a turn has slipped, and has not come back.
  [[nodiscard]] std::optional<int> slipped() const;

 private:
  const BeamStructure& structure_;
  std::vector<double> angle_;  // per element; cables: 0
  std::vector<int> turns_;
};

}  // namespace limber::beams::detail
