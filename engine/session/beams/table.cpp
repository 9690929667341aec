#include "engine/session/beams/table.h"

#include <limits>

#include "engine/beams/results/stations.h"

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

/// Forces and moments, in the order of their components.
constexpr std::array<std::pair<const char*, const char*>, beams::SectionForces::kComponents>
    kComponents{{{"axial_force", "N"},
                 {"torque", "N m"},
                 {"shear_2", "N"},
                 {"shear_3", "N"},
                 {"moment_2", "N m"},
                 {"moment_3", "N m"}}};

bool has_yield_stress(const beams::BeamModel& model, std::size_t element) {
  const auto section = static_cast<std::size_t>(model.elements[element].section);
  return model.sections[section].yield_stress > 0;
}

void add_extremes(const std::vector<beams::ElementExtremes>& extremes,
                  std::vector<BeamColumn>& columns) {
  for (std::size_t c = 0; c < kComponents.size(); ++c) {
    const auto add = [&](const char* what, const char* unit, double beams::Extremes::*member) {
      Eigen::VectorXd values(static_cast<Eigen::Index>(extremes.size()));
      for (std::size_t e = 0; e < extremes.size(); ++e)
        values[static_cast<Eigen::Index>(e)] = extremes[e][c].*member;
      columns.push_back({std::string(kComponents[c].first) + what, unit, std::move(values)});
    };
    add("_least", kComponents[c].second, &beams::Extremes::least);
    add("_least_place", "1", &beams::Extremes::least_place);
    add("_largest", kComponents[c].second, &beams::Extremes::largest);
    add("_largest_place", "1", &beams::Extremes::largest_place);
  }
}

/// As a share of the yield stress; NaN if that is not known.
Eigen::VectorXd utilisations(const BeamAnalysis& analysis) {
  const beams::BeamModel& model = analysis.structure.model();
  Eigen::VectorXd values = column(analysis.results.stresses, &beams::ElementStresses::utilisation);
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    if (!has_yield_stress(model, e))
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
  const auto& places = analysis.results.governing_places;
  std::vector<BeamColumn> columns{
      {"axial_force", "N", column(forces, &Forces::axial)},
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
       Eigen::VectorXd::Map(energies.data(), static_cast<Eigen::Index>(energies.size()))},
      {"governing_place", "1",
       Eigen::VectorXd::Map(places.data(), static_cast<Eigen::Index>(places.size()))}};
  add_extremes(analysis.results.extremes, columns);
  return columns;
}

std::vector<BeamColumn> station_columns(const BeamAnalysis& analysis, int count) {
  const beams::BeamModel& model = analysis.structure.model();
  const auto rows = static_cast<Eigen::Index>(model.elements.size()) * count;
  std::vector<BeamColumn> columns{{"place", "1", Eigen::VectorXd(rows)}};
  for (const auto& [name, unit] : kComponents)
    columns.push_back({name, unit, Eigen::VectorXd(rows)});
  columns.push_back({"equivalent_stress", "Pa", Eigen::VectorXd(rows)});
  columns.push_back({"utilisation", "1", Eigen::VectorXd(rows)});
  Eigen::Index row = 0;
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    const bool is_known = has_yield_stress(model, e);
    for (const beams::Station& station :
         stations_along(analysis.results, model, static_cast<int>(e), count)) {
      std::size_t c = 0;
      columns[c++].values[row] = station.place;
      for (const double component : station.forces.components())
        columns[c++].values[row] = component;
      columns[c++].values[row] = station.equivalent;
      columns[c].values[row] =
          is_known ? station.utilisation : std::numeric_limits<double>::quiet_NaN();
      ++row;
    }
  }
  return columns;
}

}  // namespace limber::session::detail
