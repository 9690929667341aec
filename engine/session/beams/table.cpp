#include "engine/session/beams/table.h"

#include <limits>

namespace limber::session::detail {
namespace {

void add_vectors(const std::array<const char*, 3>& names, const char* unit,
                 const Eigen::Matrix3Xd& values, std::vector<BeamColumn>& columns) {
  for (int axis = 0; axis < 3; ++axis)
    columns.push_back({names[static_cast<std::size_t>(axis)], unit, values.row(axis).transpose()});
}

template <class Rows, class Member>
Eigen::VectorXd column(const Rows& rows, Member member) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    values[static_cast<Eigen::Index>(i)] = rows[i].*member;
  return values;
}

/// Of the yield stress; not a number where that is not known.
Eigen::VectorXd utilisations(const BeamAnalysis& analysis) {
  const beams::BeamModel& model = analysis.structure.model();
  Eigen::VectorXd values = column(analysis.results.stresses, &beams::ElementStresses::utilisation);
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    const auto section = static_cast<std::size_t>(model.elements[e].section);
    if (!(model.sections[section].yield_stress > 0))
      values[static_cast<Eigen::Index>(e)] = std::numeric_limits<double>::quiet_NaN();
  }
  return values;
}

}  // namespace

Eigen::Matrix3Xd rotation_vectors(const beams::BeamState& state) {
  Eigen::Matrix3Xd vectors(3, state.nodes());
  for (int i = 0; i < state.nodes(); ++i) {
    const Eigen::AngleAxisd turn(state.rotations[static_cast<std::size_t>(i)]);
    vectors.col(i) = turn.angle() * turn.axis();
  }
  return vectors;
}

std::vector<BeamColumn> node_columns(const BeamAnalysis& analysis) {
  const beams::BeamResults& results = analysis.results;
  std::vector<BeamColumn> columns;
  add_vectors({"x", "y", "z"}, "m", analysis.solution.state.positions, columns);
  add_vectors({"rotation_x", "rotation_y", "rotation_z"}, "rad",
              rotation_vectors(analysis.solution.state), columns);
  add_vectors({"reaction_force_x", "reaction_force_y", "reaction_force_z"}, "N",
              results.reaction_forces, columns);
  add_vectors({"reaction_moment_x", "reaction_moment_y", "reaction_moment_z"}, "N m",
              results.reaction_moments, columns);
  return columns;
}

std::vector<BeamColumn> element_columns(const BeamAnalysis& analysis) {
  using Forces = beams::ElementForces;
  using Stresses = beams::ElementStresses;
  const auto& forces = analysis.results.forces;
  const auto& stresses = analysis.results.stresses;
  const auto& energies = analysis.results.element_energies;
  return {{"axial_force", "N", column(forces, &Forces::axial)},
          {"torque", "N m", column(forces, &Forces::torque)},
          {"shear_2", "N", column(forces, &Forces::shear_2)},
          {"shear_3", "N", column(forces, &Forces::shear_3)},
          {"start_moment_2", "N m", column(forces, &Forces::start_moment_2)},
          {"start_moment_3", "N m", column(forces, &Forces::start_moment_3)},
          {"finish_moment_2", "N m", column(forces, &Forces::finish_moment_2)},
          {"finish_moment_3", "N m", column(forces, &Forces::finish_moment_3)},
          {"axial_stress", "Pa", column(stresses, &Stresses::axial)},
          {"bending_stress", "Pa", column(stresses, &Stresses::bending)},
          {"torsion_stress", "Pa", column(stresses, &Stresses::torsion)},
          {"equivalent_stress", "Pa", column(stresses, &Stresses::equivalent)},
          {"utilisation", "1", utilisations(analysis)},
          {"energy", "J",
           Eigen::VectorXd::Map(energies.data(), static_cast<Eigen::Index>(energies.size()))}};
}

}  // namespace limber::session::detail
