#include "bench/beam_evidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/index.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/balance.h"
#include "tests/support/beam_structures.h"

namespace limber::bench {
namespace {

using beams::BeamModel;
using beams::BeamState;
using beams::BeamStructure;
using beams::ElementEnd;

double largest_distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).colwise().norm().maxCoeff();
}

/// Every node at its place; rotations as free as they are in the model.
BeamModel held_at(const BeamModel& model, const Eigen::Matrix3Xd& places) {
  BeamModel held = model;
  held.motions.clear();
  for (beams::BeamSupport& support : held.supports)
    support.fixed = {false, false, false, support.fixed[3], support.fixed[4], support.fixed[5]};
  for (int i = 0; i < static_cast<int>(model.nodes.size()); ++i) {
    beams::PrescribedMotion motion;
    motion.node = i;
    motion.translates = {true, true, true};
    motion.translation = places.col(i) - model.nodes[index(i)].position;
    for (const beams::PrescribedMotion& given : model.motions) {
      if (given.node != i) continue;
      motion.rotates = given.rotates;
      motion.rotation = given.rotation;
      motion.translation = given.axes.transpose() * motion.translation;
      motion.axes = given.axes;
    }
    held.motions.push_back(motion);
  }
  return held;
}

/// Largest compression of an element over 4 pi^2 EI / L^2.
double largest_pressure(const BeamStructure& structure, const BeamState& state) {
  const beams::BeamResults results = results_of(structure, state);
  double largest = 0;
  for (int e = 0; e < structure.elements(); ++e) {
    const auto& element = structure.model().elements[index(e)];
    const auto& section = structure.model().sections[index(element.section)];
    const double length = structure.constants(e).length;
    const double buckles = 4 * std::numbers::pi * std::numbers::pi *
                           std::min(section.bending_2, section.bending_3) / (length * length);
    largest = std::max(largest, -results.forces[index(e)].axial / buckles);
  }
  return largest;
}

}  // namespace

PlacesEvidence examine_places(const BeamStructure& structure, const Eigen::Matrix3Xd& places,
                              const BeamState& near) {
  PlacesEvidence evidence;
  BeamState state = near;
  state.positions = places;
  state = find_equilibrium_from(BeamStructure(held_at(structure.model(), places)), state).state;
  const beams::detail::Balance balance(structure);
  const beams::NodeLoads loads = beams::NodeLoads::of(structure.model());
  const Eigen::VectorXd left =
      elastic_gradient(structure, state) - load_vector(structure, loads, state);
  evidence.residual = balance.imbalance(left, balance.present(state, loads)).scaled;
  evidence.energy = elastic_energies(structure, state).total();
  const beams::BeamSolution after = find_equilibrium_from(structure, state);
  evidence.moved = largest_distance(after.state.positions, places);
  evidence.energy_after = after.report.elastic_energy;
  evidence.apart = largest_distance(after.state.positions, near.positions);
  evidence.status = to_string(after.report.status);
  return evidence;
}

BeamState cut_state(const BeamStructure& structure, const BeamState& state, int parts) {
  const BeamModel& model = structure.model();
  BeamState cut = state;
  const int added = (parts - 1) * structure.elements();
  cut.positions.conservativeResize(3, structure.nodes() + added);
  Eigen::Index place = structure.nodes();
  for (int e = 0; e < structure.elements(); ++e) {
    const beams::BeamElement& element = model.elements[index(e)];
    const Eigen::Vector3d axis = structure.rest_axes(e).col(0);
    const double length = structure.constants(e).length;
    const Eigen::Vector3d from = state.positions.col(element.start);
    const Eigen::Vector3d to = state.positions.col(element.finish);
    const Eigen::Vector3d leaves =
        length * (structure.end_rotation(state, e, ElementEnd::kStart) * axis);
    const Eigen::Vector3d arrives =
        length * (structure.end_rotation(state, e, ElementEnd::kFinish) * axis);
    for (int i = 1; i < parts; ++i) {
      const double t = static_cast<double>(i) / parts, t2 = t * t, t3 = t2 * t;
      cut.positions.col(place++) = (2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * leaves +
                                   (3 * t2 - 2 * t3) * to + (t3 - t2) * arrives;
      const Eigen::Quaterniond turned =
          state.rotations[index(element.start)].slerp(t, state.rotations[index(element.finish)]);
      const Eigen::Vector3d tangent = (6 * t2 - 6 * t) * (from - to) +
                                      (3 * t2 - 4 * t + 1) * leaves + (3 * t2 - 2 * t) * arrives;
      cut.rotations.push_back(rotations::shortest_rotation(turned * axis, tangent) * turned);
    }
  }
  return cut;
}

std::vector<CutEvidence> cut_finer(const BeamModel& model, const BeamState& state, int most_parts) {
  const BeamStructure structure(model);
  std::vector<CutEvidence> found;
  BeamState start = state;
  for (int parts = 1; parts <= most_parts; ++parts) {
    const BeamStructure cut(testing::refined(model, parts));
    if (parts > 1) start = cut_state(structure, start, parts);
    const beams::BeamSolution solution = find_equilibrium_from(cut, start);
    CutEvidence evidence;
    evidence.parts = parts;
    evidence.energy = solution.report.elastic_energy;
    evidence.positions = solution.state.positions.leftCols(structure.nodes());
    evidence.largest_pressure = largest_pressure(cut, solution.state);
    evidence.status = to_string(solution.report.status);
    const Eigen::Matrix3Xd& before = found.empty() ? state.positions : found.back().positions;
    evidence.moved = largest_distance(evidence.positions, before);
    evidence.rms_moved = std::sqrt((evidence.positions - before).squaredNorm() /
                                   static_cast<double>(structure.nodes()));
    found.push_back(std::move(evidence));
    // The next one starts from this shape at the nodes that all have.
    start.positions = found.back().positions;
    start.rotations.assign(solution.state.rotations.begin(),
                           solution.state.rotations.begin() + structure.nodes());
  }
  return found;
}

}  // namespace limber::bench
