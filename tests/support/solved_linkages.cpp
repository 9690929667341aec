#include "tests/support/solved_linkages.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/rods/linkage/linkage_assembly.h"

namespace limber::rods::testing {
namespace {

/// Soft in the plane of the joints alone; without stretching that shows.
constexpr RodStiffness kPlanar{1e6, 1, 100, 100};

LinkageGraph graph_of(const std::vector<Eigen::Vector3d>& points,
                      const std::vector<Eigen::Vector2i>& lines) {
  LineMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  mesh.edges.resize(2, static_cast<Eigen::Index>(lines.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = points[i];
  for (std::size_t i = 0; i < lines.size(); ++i)
    mesh.edges.col(static_cast<Eigen::Index>(i)) = lines[i];
  return build_linkage_graph(mesh);
}

/// Points along segments, counted in edges, by those of the next finer linkage.
void move_springs(const LinkageModel& model, const HalvedLinkage& halved, Conditions& conditions) {
  for (TargetSpring& spring : conditions.springs) {
    const auto* const vertex = std::get_if<VertexPoint>(&spring.at);
    const auto* const arc = std::get_if<ArcPoint>(&spring.at);
    if (vertex == nullptr && arc == nullptr) continue;
    const int s = vertex != nullptr ? vertex->segment : arc->segment;
    const double place =
        vertex != nullptr ? vertex->vertex : arc->share * model.variables().edges(s);
    spring.at = ArcPoint{s, halved.halved_place(s, place) / halved.model().variables().edges(s)};
  }
}

}  // namespace

SolvedLinkage solved_linkage(LinkageModel model, const Conditions& conditions) {
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  const bool is_found = equilibrium.solve(state, conditions).converged();
  return {std::move(model), std::move(state), conditions, is_found};
}

SolvedLinkage cantilever_linkage(int edges, double alpha, BendingForm form) {
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}, {1, Hold::kAngle}};
  conditions.loads = {{1, {0, alpha, 0}, {0, 0, 0}, 0}};
  return solved_linkage(
      {graph_of({{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {1, 1, 0}},
                {{0, 1}, {2, 0}, {0, 3}, {4, 0}, {1, 5}}),
       edges, kPlanar, form},
      conditions);
}

SolvedLinkage ring_linkage(int edges, BendingForm form) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2i> lines;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d out(std::cos(i * std::numbers::pi / 3),
                              std::sin(i * std::numbers::pi / 3), 0);
    points.push_back(out / 6);
    lines.emplace_back(i, (i + 1) % 6);
  }
  for (int i = 0; i < 6; ++i) {
    points.push_back(points[static_cast<std::size_t>(i)] * 0.7);
    lines.emplace_back(i, 6 + i);
  }
  Conditions conditions;
  for (int j = 0; j < 6; ++j) conditions.pins.push_back({j, Hold::kAngle});
  return solved_linkage({graph_of(points, lines), edges, kPlanar, form}, conditions);
}

SolvedLinkage elastica_linkage(int edges, BendingForm form) {
  LinkageModel model(graph_of({{0, 0, 0},
                               {1, 0, 0},
                               {-1, 0, 0},
                               {2, 0, 0},
                               {0, 1, 0},
                               {0, -1, 0},
                               {1, 1, 0},
                               {1, -1, 0}},
                              {{0, 1}, {2, 0}, {1, 3}, {0, 4}, {5, 0}, {1, 6}, {7, 1}}),
                     edges, kPlanar, form);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}, {1, Hold::kMotionAndAngle}};
  bool is_found = true;
  for (const double span : {0.95, 0.8, 0.6, 0.45, 0.3}) {
    conditions.pins[1].position = Eigen::Vector3d(span, 0, 0);
    is_found = is_found && equilibrium.solve(state, conditions).converged();
  }
  return {std::move(model), std::move(state), conditions, is_found};
}

std::optional<TrueLinkageError> true_error(const SolvedLinkage& given) {
  constexpr int kLevels = 3;
  std::vector<HalvedLinkage> levels;
  levels.reserve(kLevels);
  std::vector<LinkageState> states;
  Conditions conditions = given.conditions;
  for (int k = 0; k < kLevels; ++k) {
    const LinkageModel& model = k == 0 ? given.model : levels.back().model();
    HalvedLinkage halved(model);
    LinkageState state = halved.prolonged(model, k == 0 ? given.state : states.back());
    move_springs(model, halved, conditions);
    LinkageEquilibrium equilibrium(halved.model());
    if (!equilibrium.solve(state, conditions).converged()) return {};
    levels.push_back(std::move(halved));
    states.push_back(std::move(state));
  }
  const LinkageModel& fine = levels.back().model();
  const LinkageState& state = states.back();
  const auto point = [&](int segment, double place) -> Eigen::Vector3d {
    for (const HalvedLinkage& level : levels) place = level.halved_place(segment, place);
    const int edge = std::min(static_cast<int>(place), fine.variables().edges(segment) - 1);
    return (edge + 1 - place) * state.vertex(fine, segment, edge) +
           (place - edge) * state.vertex(fine, segment, edge + 1);
  };
  TrueLinkageError error;
  for (std::size_t j = 0; j < state.joints().size(); ++j) {
    error.distance = std::max(
        error.distance, (given.state.joints()[j].position - state.joints()[j].position).norm());
  }
  for (int s = 0; s < fine.variables().segments(); ++s) {
    for (int i = 1; i < given.model.variables().edges(s); ++i) {
      error.distance =
          std::max(error.distance, (given.state.vertex(given.model, s, i) - point(s, i)).norm());
    }
  }
  LinkageAssembly here(given.model), there(fine);
  const double limit = there.energies(state).total();
  error.energy = std::abs(here.energies(given.state).total() / limit - 1);
  return error;
}

DiscretisationError estimate_of(const SolvedLinkage& given) {
  return DiscretisationEstimator(given.model).estimate(given.model, given.state, given.conditions);
}

}  // namespace limber::rods::testing
