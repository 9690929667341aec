#include "tests/support/beam_problems.h"

#include <cmath>
#include <numbers>

namespace limber::testing {

using namespace beams;

namespace {}  // namespace

BeamSupport clamped(int node) { return {node, {true, true, true, true, true, true}}; }

BeamModel straight_beam(int elements, double length, double slenderness) {
  BeamModel model;
  const double ei = 1, radius = length / slenderness;
  model.sections.push_back({ei / (radius * radius), ei, ei, ei});
  for (int i = 0; i <= elements; ++i)
    model.nodes.push_back({Eigen::Vector3d(length * i / elements, 0, 0)});
  for (int i = 0; i < elements; ++i) {
    BeamElement e;
    e.start = i;
    e.finish = i + 1;
    model.elements.push_back(e);
  }
  return model;
}

BeamModel cantilever_model(int elements, double alpha, double length, double slenderness) {
  BeamModel model = straight_beam(elements, length, slenderness);
  model.supports.push_back(clamped(0));
  model.loads.push_back({elements, {0, 0, alpha / (length * length)}});
  return model;
}

BeamModel shallow_arch(double load, ArchMoves moves) {
  const int n = 16;
  BeamModel model = straight_beam(n, 1, 500);
  for (int i = 0; i <= n; ++i)
    model.nodes[static_cast<std::size_t>(i)].position.z() =
        0.05 * std::sin(std::numbers::pi * i / n);
  model.supports = {clamped(0), clamped(n)};
  for (int i = 1; i < n && moves == ArchMoves::kInItsPlane; ++i)
    model.supports.push_back({i, {false, true, false, true, false, true}});
  model.loads.push_back({n / 2, {0, 0, -load}});
  return model;
}

BeamModel pressed_cantilever(double load) {
  BeamModel model = straight_beam(16, 1, 1000);
  model.supports = {clamped(0)};
  model.loads.push_back({16, {-load, 0, 1e-3}});
  return model;
}

BeamAnswer beam_cantilever(int elements, double alpha, double deflection, double shortening,
                           const BeamSolveOptions& options) {
  const BeamStructure structure(cantilever_model(elements, alpha));
  const BeamSolution found = find_equilibrium(structure, options);
  const Eigen::Vector3d tip = found.state.positions.col(elements);
  return {(tip - Eigen::Vector3d(1 - shortening, 0, deflection)).norm(), found.report};
}

BeamModel roll_up_model(int elements) {
  BeamModel model = straight_beam(elements);
  model.supports.push_back(clamped(0));
  // Out of the plane, a moment of fixed direction has no potential and the beam would buckle.
  for (int i = 1; i <= elements; ++i)
    model.supports.push_back({i, {false, true, false, true, false, true}});
  NodalLoad load;
  load.node = elements;
  load.moment = Eigen::Vector3d(0, -2 * std::numbers::pi, 0);
  model.loads.push_back(load);
  return model;
}

BeamAnswer beam_roll_up(int elements, const BeamSolveOptions& options) {
  const BeamSolution found = find_equilibrium(BeamStructure(roll_up_model(elements)), options);
  return {found.state.positions.col(elements).norm(), found.report};
}

BeamModel compressed_model(int elements, BeamEnds ends, double span) {
  BeamModel model = straight_beam(elements);
  PrescribedMotion motion;
  motion.node = elements;
  motion.translates = {true, true, true};
  motion.translation = Eigen::Vector3d(span - 1, 0, 0);
  if (ends == BeamEnds::kClamped) {
    model.supports.push_back(clamped(0));
    motion.rotates = {true, true, true};
    // The known answer is a curve in a plane. In space, with equal stiffnesses, it turns about the
    // line of its ends without resistance, and past 90 degrees leaves its plane.
    for (int i = 1; i < elements; ++i)
      model.supports.push_back({i, {false, true, false, true, false, true}});
  } else {
    // Out of its plane a hinged beam would turn about its ends.
    model.supports.push_back({0, {true, true, true, true, false, true}});
    model.supports.push_back({elements, {false, false, false, true, false, true}});
  }
  model.motions.push_back(motion);
  for (int i = 1; i < elements; ++i) model.temporary_loads.push_back({i, {0, 0, 40.0 / elements}});
  return model;
}

BeamAnswer beam_compressed(int elements, BeamEnds ends, double span, double height,
                           const BeamSolveOptions& options) {
  const BeamSolution found =
      find_equilibrium(BeamStructure(compressed_model(elements, ends, span)), options);
  const double top = found.state.positions.row(2).cwiseAbs().maxCoeff();
  return {std::abs(top - height) / height, found.report};
}

BeamModel bend_model(int elements, double force, double torsion_constant) {
  constexpr double kRadius = 100, kModulus = 1e7;
  BeamModel model;
  model.sections.push_back(
      {kModulus, 0.5 * kModulus * torsion_constant, kModulus / 12, kModulus / 12});
  for (int i = 0; i <= elements; ++i) {
    const double phi = 0.25 * std::numbers::pi * i / elements;
    model.nodes.push_back(
        {Eigen::Vector3d(kRadius * std::sin(phi), kRadius * (1 - std::cos(phi)), 0)});
  }
  for (int i = 0; i < elements; ++i) {
    BeamElement e;
    e.start = i;
    e.finish = i + 1;
    model.elements.push_back(e);
  }
  model.supports.push_back(clamped(0));
  model.loads.push_back({elements, {0, 0, force}});
  return model;
}

BeamAnswer beam_bend(int elements, double force, double torsion_constant,
                     const Eigen::Vector3d& tip, const BeamSolveOptions& options) {
  const BeamSolution found =
      find_equilibrium(BeamStructure(bend_model(elements, force, torsion_constant)), options);
  const Eigen::Vector3d place = found.state.positions.col(elements);
  return {(place - tip).norm() / (25 * std::numbers::pi), found.report};
}

}  // namespace limber::testing
