#pragma once

#include <cmath>
#include <optional>

#include "engine/beams/model/beam_model.h"

// Structures of beams and motions of their nodes, for tests of sessions.

namespace limber::session::test {

inline beams::BeamSupport held(int node) {
  beams::BeamSupport support;
  support.node = node;
  support.fixed = {true, true, true, true, true, true};
  return support;
}

/// Along x, L = 1 m, EI = 1 N m^2, clamped at node 0, with a force down at its tip.
inline beams::BeamModel cantilever(int elements, double load) {
  beams::BeamModel model;
  model.sections.push_back(beams::make_section(beams::rectangle(0.01, 0.01), {12e8, 0.3, 0, 0}));
  for (int i = 0; i <= elements; ++i) {
    beams::BeamNode node;
    node.position.x() = static_cast<double>(i) / elements;
    model.nodes.push_back(node);
  }
  for (int i = 0; i < elements; ++i) {
    beams::BeamElement element;
    element.start = i;
    element.finish = i + 1;
    model.elements.push_back(element);
  }
  model.supports.push_back(held(0));
  if (load != 0) model.loads.push_back({elements, {0, 0, -load}});
  return model;
}

/// Clamped at both ends; under some 14 N at its middle it snaps through, too wide to roll sideways.
inline beams::BeamModel shallow_arch(double load) {
  constexpr double kPi = 3.14159265358979323846;
  const int n = 16;
  beams::BeamModel model = cantilever(n, 0);
  beams::BeamSection& section = model.sections[0];
  section.stretching = 500.0 * 500.0;
  section.bending_2 = 1;
  section.bending_3 = section.torsion = 100;
  for (int i = 0; i <= n; ++i)
    model.nodes[static_cast<std::size_t>(i)].position.z() = 0.05 * std::sin(kPi * i / n);
  model.supports.push_back(held(n));
  model.loads.push_back({n / 2, {0, 0, -load}});
  return model;
}

/// A force on a node, none by default.
inline beams::NodalLoad force_on(int node, double x = 0, double y = 0, double z = 0) {
  beams::NodalLoad load;
  load.node = node;
  load.force = {x, y, z};
  return load;
}

inline beams::PrescribedMotion moved(int node, std::optional<double> x, std::optional<double> y,
                                     std::optional<double> z) {
  beams::PrescribedMotion motion;
  motion.node = node;
  motion.translates = {x.has_value(), y.has_value(), z.has_value()};
  motion.translation = {x.value_or(0), y.value_or(0), z.value_or(0)};
  return motion;
}

inline beams::PrescribedMotion turned(int node, const Eigen::Vector3d& rotation) {
  beams::PrescribedMotion motion;
  motion.node = node;
  motion.rotates = {true, true, true};
  motion.rotation = rotation;
  return motion;
}

}  // namespace limber::session::test
