#include "engine/beams/solver/element_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/beams/results/beam_results.h"

namespace limber::beams::detail {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2;
// Of the force at which an element buckles. Public structures whose rims are brought in at once
// stay below; a straight column that nothing pushes aside does not.
constexpr double kHopeless = 2;

/// Angle between an end and the chord [rad].
double bend_of(const BeamStructure& structure, const BeamState& state, int element) {
  const BeamElement& e = structure.model().elements[static_cast<std::size_t>(element)];
  const Eigen::Vector3d chord = state.positions.col(e.finish) - state.positions.col(e.start);
  double largest = 0;
  for (const ElementEnd end : {ElementEnd::kStart, ElementEnd::kFinish}) {
    const Eigen::Vector3d axis =
        structure.end_rotation(state, element, end) * structure.rest_axes(element).col(0);
    largest = std::max(largest, std::atan2(axis.cross(chord).norm(), axis.dot(chord)));
  }
  return largest;
}

}  // namespace

std::optional<ElementDoubt> doubt_elements(const BeamStructure& structure, const BeamState& state) {
  const BeamResults results = results_of(structure, state);
  std::optional<ElementDoubt> found;
  double worst = 1;
  for (int i = 0; i < structure.elements(); ++i) {
    const BeamElement& element = structure.model().elements[static_cast<std::size_t>(i)];
    if (element.kind != BeamKind::kBeam) continue;
    const BeamSection& section =
        structure.model().sections[static_cast<std::size_t>(element.section)];
    const double length = structure.constants(i).length;
    const double buckles = 4 * std::numbers::pi * std::numbers::pi *
                           std::min(section.bending_2, section.bending_3) / (length * length);
    const double pressed = -results.forces[static_cast<std::size_t>(i)].axial / buckles;
    const double bend = bend_of(structure, state, i);
    if (std::max(pressed, bend / kQuarterTurn) <= worst) continue;
    worst = std::max(pressed, bend / kQuarterTurn);
    found = ElementDoubt{};
    found->element = i;
    found->hopeless = bend > kQuarterTurn || pressed > kHopeless;
    found->message =
        pressed > bend / kQuarterTurn
            ? fmt::format(
                  "element {} is pressed with {:.3g} times the force at which it buckles by "
                  "itself: take shorter elements, or a load that chooses a side",
                  i, pressed)
            : fmt::format(
                  "element {} has folded: an end has turned by {:.2f} rad against its "
                  "chord; take shorter elements",
                  i, bend);
  }
  return found;
}

}  // namespace limber::beams::detail
