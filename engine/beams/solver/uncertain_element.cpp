#include "engine/beams/solver/uncertain_element.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/twist_watch.h"

namespace limber::beams::detail {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2;  // [rad]
// Share of the force at which an element buckles. Public structures whose rims are brought in at
// once stay below; a straight column that nothing pushes aside does not.
constexpr double kHopeless = 2;
constexpr double kVisiblyOff = 0.005;  // of a torque: at a twist of 1.25 rad

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

/// Distance of an element from the beam that it stands for, by the measure that makes it doubtful;
/// above 1 it is.
struct Uncertainty {
  double size = 0;
  bool hopeless = false;
  int element = -1;
  enum class Of { kPressure, kBend, kTwist } of = Of::kPressure;
  double measure = 0;  // times its buckling load, or [rad]
  double off = 0;      // share of a torque

  [[nodiscard]] bool is_worse_than(const Uncertainty& other) const {
    return hopeless != other.hopeless ? hopeless : size > other.size;
  }
};

Uncertainty of_pressure(const BeamStructure& structure, const BeamState& state, int i) {
  const BeamElement& element = structure.model().elements[static_cast<std::size_t>(i)];
  const BeamSection& section =
      structure.model().sections[static_cast<std::size_t>(element.section)];
  const double length = structure.constants(i).length;
  const double buckles = 4 * std::numbers::pi * std::numbers::pi *
                         std::min(section.bending_2, section.bending_3) / (length * length);
  const double pressed = -strain_force(structure, state, i) / buckles;
  return {pressed, pressed > kHopeless, i, Uncertainty::Of::kPressure, pressed};
}

Uncertainty of_bend(const BeamStructure& structure, const BeamState& state, int i) {
  const double bend = bend_of(structure, state, i);
  return {bend / kQuarterTurn, bend > kQuarterTurn, i, Uncertainty::Of::kBend, bend};
}

Uncertainty of_twist(const BeamStructure& structure, const ElementTwist& twist) {
  const ElementConstants<double>& k = structure.constants(twist.element);
  const BeamElement& element = structure.model().elements[static_cast<std::size_t>(twist.element)];
  const TwistMeasure<double> measure(std::sin(twist.angle), std::cos(twist.angle));
  const double strain = twist.angle - element.rest_curvature.x() * k.length;
  const double torque = (measure.value - k.rest_twist) * measure.slope;  // over GJ / L
  const double off = std::abs(strain) > 1e-3 ? std::abs(1 - torque / strain) : 0;
  const bool hopeless = std::abs(twist.angle) > kMaxTwistRad;
  return {off / kVisiblyOff, hopeless, twist.element, Uncertainty::Of::kTwist, twist.angle, off};
}

std::string describe(const BeamModel& model, const Uncertainty& worry) {
  switch (worry.of) {
    case Uncertainty::Of::kPressure:
      return fmt::format(
          "{} is pressed with {:.3g} times the force at which it buckles by itself: take "
          "shorter elements, or a load that chooses a side",
          element_name(model, worry.element), worry.measure);
    case Uncertainty::Of::kBend:
      return fmt::format(
          "{} has folded: an end has turned by {:.2f} rad against its chord; take shorter "
          "elements",
          element_name(model, worry.element), worry.measure);
    case Uncertainty::Of::kTwist:
      break;
  }
  return fmt::format(
      "{} is twisted by {:.2f} rad between its ends, its torque {:.1f} % off: take shorter "
      "elements",
      element_name(model, worry.element), worry.measure, 100 * worry.off);
}

}  // namespace

std::optional<UncertainElement> find_uncertain_element(const BeamStructure& structure,
                                                       const BeamState& state) {
  Uncertainty worst;
  worst.size = 1;
  const auto weigh = [&worst](const Uncertainty& worry) {
    if ((worry.size > 1 || worry.hopeless) && worry.is_worse_than(worst)) worst = worry;
  };
  for (int i = 0; i < structure.elements(); ++i) {
    if (structure.model().elements[static_cast<std::size_t>(i)].kind != BeamKind::kBeam) continue;
    weigh(of_pressure(structure, state, i));
    weigh(of_bend(structure, state, i));
  }
  if (const ElementTwist twist = most_twisted(structure, state); twist.element >= 0)
    weigh(of_twist(structure, twist));
  if (worst.element < 0) return {};
  return UncertainElement{worst.element, worst.hopeless, describe(structure.model(), worst)};
}

}  // namespace limber::beams::detail
