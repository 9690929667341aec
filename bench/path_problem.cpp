#include "bench/path_problem.h"

#include <cmath>
#include <numbers>

#include "engine/session/bodies/problem_mapping.h"
#include "tests/support/published.h"

namespace limber::bench {
namespace {

/// The node that mode k moves farthest.
int farthest_node(const reduced::ReducedModel& model, int k) {
  Eigen::Index node = 0;
  Eigen::Map<const Eigen::Matrix3Xd>(model.modes.col(model.rigid_count + k).data(), 3,
                                     model.node_count)
      .colwise()
      .squaredNorm()
      .maxCoeff(&node);
  return static_cast<int>(node);
}

}  // namespace

SpacetimeProblem path_problem(const NamedBody& named,
                              std::shared_ptr<const reduced::ReducedModel> model,
                              const PathShape& shape) {
  constexpr int kNodes = 3, kMoved = 6;
  SpacetimeProblem problem;
  problem.scene = named.name;
  problem.tets = named.body.mesh.tet_count();
  problem.dynamics = session::map_dynamics(testing::published_dynamics(shape.period),
                                           model->eigenvalues.head(shape.modes), model->rigid_count,
                                           model->mechanism_count);
  problem.timeline.frame_count = shape.frames;

  const int count = shape.constraints, moved = std::min(kMoved, shape.modes);
  std::vector<int> frames;
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(model->coordinate_count(), count);
  for (int i = 0; i < count; ++i) {
    const double part = 0.1 + 0.8 * i / std::max(1, count - 1);
    frames.push_back(static_cast<int>(std::lround(part * (shape.frames - 1))));
    for (int k = 0; k < moved; ++k) {
      z(k, i) = std::sin(std::numbers::pi * (k + 2) * part + k) *
                std::sin(std::numbers::pi * part) / (1 + k);
    }
  }
  reduced::ReducedKinematics kinematics(model);
  std::vector<reduced::SiteQuery> queries;
  std::vector<int> nodes;
  for (int i = 0; i < count; ++i) {
    nodes.push_back(farthest_node(*model, std::min(i % kNodes, moved - 1)));
    queries.push_back({kinematics.add_site({nodes.back()}), i});
  }
  Eigen::Matrix3Xd u;
  kinematics.evaluate(frames, z, queries, u, nullptr);
  z *= shape.reach * model->length / u.colwise().norm().maxCoeff();  // about: u is nearly linear
  kinematics.evaluate(frames, z, queries, u, nullptr);
  for (int i = 0; i < count; ++i) {
    NodeConstraint item{{nodes[i]}, {}};
    item.constraint.id = static_cast<spacetime::ConstraintId>(i + 1);
    item.constraint.frame = frames[i];
    item.constraint.target = u.col(i);
    problem.constraints.push_back(item);
  }
  problem.model = std::move(model);
  return problem;
}

}  // namespace limber::bench
