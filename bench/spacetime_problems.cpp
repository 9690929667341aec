#include "bench/spacetime_problems.h"

#include <cmath>
#include <numbers>
#include <random>

#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/problem_mapping.h"
#include "tests/support/chain_kinematics.h"
#include "tests/support/published.h"

namespace limber::bench {

using reduced::ReducedKinematics;
using reduced::ReducedModel;

namespace {

std::shared_ptr<const ReducedModel> build(const bodies::ElasticBody& body, int modes, int basis,
                                          int cubature) {
  reduced::ModelOptions options;
  options.mode_count = modes;
  options.basis_size = basis;
  options.cubature_size = cubature;
  return std::make_shared<const ReducedModel>(reduced::build_model(body, options));
}

/// r of all problems.
constexpr int kProblemModes = 30;

void keep_first_modes(int modes, spacetime::ModeDynamics& dynamics) {
  dynamics.stiffness.conservativeResize(modes);
  dynamics.damping.conservativeResize(modes);
}

}  // namespace

SpacetimeProblem sample_problem(const std::string& name, int coordinates, Recorder& recorder) {
  const scene::Scene scene = scene::make_sample(name);
  const session::MappedBody mapped = session::map_body(scene);
  recorder.note("building the model of " + name);
  SpacetimeProblem problem;
  problem.scene = name;
  problem.tets = mapped.body.mesh.tet_count();
  problem.model = build(mapped.body, coordinates, 80, 32);
  problem.dynamics = session::map_dynamics(
      testing::published_dynamics(scene.dynamics.period_frames), problem.model->eigenvalues,
      problem.model->rigid_count, problem.model->mechanism_count);
  keep_first_modes(kProblemModes, problem.dynamics);
  problem.timeline = {scene.frame_count, session::map_end(scene.first_end),
                      session::map_end(scene.last_end)};
  const session::TargetFrame frame(scene, mapped);
  for (const scene::Constraint& item : scene.constraints) {
    const reduced::Site site = frame.site(item);
    NodeConstraint result{site.nodes, {}};
    result.constraint.id = problem.constraints.size() + 1;
    result.constraint.frame = item.frame;
    result.constraint.axes = item.axes;
    result.constraint.weight = item.weight;
    result.constraint.target = frame.displacement(item.target, frame.origin(item.kind, site));
    problem.constraints.push_back(result);
  }
  return problem;
}

namespace {

/// Nodes that swing far and lie apart (head, hands, tail), by farthest-point sampling of the
/// displacements of the first modes.
std::vector<int> outer_nodes(const bodies::ElasticBody& body, const ReducedModel& model,
                             int count) {
  const auto nodes = static_cast<Eigen::Index>(model.node_count);
  Eigen::VectorXd swing = Eigen::VectorXd::Zero(nodes);
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(6, model.modes.cols()); ++k) {
    for (Eigen::Index i = 0; i < nodes; ++i)
      swing[i] += model.modes.col(k).segment<3>(3 * i).squaredNorm();
  }
  std::vector<int> chosen;
  Eigen::VectorXd distance = Eigen::VectorXd::Ones(nodes);
  for (int i = 0; i < count; ++i) {
    Eigen::Index best = 0;
    swing.cwiseProduct(distance).maxCoeff(&best);
    const Eigen::RowVectorXd apart =
        (body.mesh.nodes.colwise() - Eigen::Vector3d(body.mesh.nodes.col(best)))
            .colwise()
            .squaredNorm();
    distance =
        i == 0 ? Eigen::VectorXd(apart) : Eigen::VectorXd(distance.cwiseMin(apart.transpose()));
    chosen.push_back(static_cast<int>(best));
  }
  return chosen;
}

}  // namespace

std::optional<SpacetimeProblem> tyrannosaurus_problem(int coordinates, const SuiteOptions& options,
                                                      Recorder& recorder) {
  constexpr int kFrames = 350, kConstraints = 27, kMoved = 8;
  const std::optional<NamedBody> named = load_body("tyrannosaurus", options);
  if (!named) return std::nullopt;
  recorder.note("building the model of tyrannosaurus");
  SpacetimeProblem problem;
  problem.scene = "tyrannosaurus";
  problem.tets = named->body.mesh.tet_count();
  problem.model = build(named->body, coordinates, 80, 32);
  problem.dynamics =
      session::map_dynamics(testing::published_dynamics(60), problem.model->eigenvalues, 0);
  keep_first_modes(kProblemModes, problem.dynamics);
  problem.timeline.frame_count = kFrames;
  const std::vector<int> nodes = outer_nodes(named->body, *problem.model, 3);

  std::mt19937_64 generator(2014);
  Eigen::MatrixXd amplitude(kMoved, 4);
  for (auto& value : amplitude.reshaped()) value = testing::uniform(generator);
  std::vector<int> frames;
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(coordinates, kConstraints);
  for (int i = 0; i < kConstraints; ++i) {
    frames.push_back(25 + 300 * i / (kConstraints - 1));
    const double time = static_cast<double>(frames.back()) / (kFrames - 1);
    for (int k = 0; k < kMoved; ++k) {
      for (int wave = 0; wave < amplitude.cols(); ++wave) {
        z(k, i) += amplitude(k, wave) / (1 + 0.5 * k) / (wave + 1) *
                   std::sin(std::numbers::pi * (wave + 1) * time);
      }
    }
  }
  ReducedKinematics kinematics(problem.model);
  std::vector<reduced::SiteQuery> queries;
  for (int i = 0; i < kConstraints; ++i)
    queries.push_back({kinematics.add_site({nodes[static_cast<std::size_t>(i % 3)]}), i});
  Eigen::Matrix3Xd u;
  kinematics.evaluate(frames, z, queries, u, nullptr);
  const double scale =
      0.25 * problem.model->length / u.colwise().norm().maxCoeff();  // about: u is nearly linear
  z *= scale;
  kinematics.evaluate(frames, z, queries, u, nullptr);
  for (int i = 0; i < kConstraints; ++i) {
    NodeConstraint item{{nodes[static_cast<std::size_t>(i % 3)]}, {}};
    item.constraint.id = static_cast<spacetime::ConstraintId>(i + 1);
    item.constraint.frame = frames[static_cast<std::size_t>(i)];
    const Eigen::Vector3d off(testing::uniform(generator), testing::uniform(generator),
                              testing::uniform(generator));
    item.constraint.target = u.col(i) + 0.003 * problem.model->length * off;
    problem.constraints.push_back(item);
  }
  return problem;
}

std::vector<spacetime::PositionConstraint> place_constraints(const SpacetimeProblem& problem,
                                                             ReducedKinematics& kinematics) {
  std::vector<spacetime::PositionConstraint> constraints;
  constraints.reserve(problem.constraints.size());
  for (const NodeConstraint& item : problem.constraints) {
    constraints.push_back(item.constraint);
    constraints.back().site = kinematics.add_site(item.nodes);
  }
  return constraints;
}

}  // namespace limber::bench
