#include "bench/exact_scenes.h"

#include <cmath>
#include <numbers>

#include "engine/scene/samples/samples.h"

namespace limber::bench {
namespace {

using Eigen::Index;

constexpr double kDegree = std::numbers::pi / 180;

scene::Scene beam_without_targets() {
  scene::Scene scene = scene::make_sample("beam");
  scene.constraints.clear();
  scene.keyframes.clear();
  scene.frame_count = 200;
  return scene;
}

}  // namespace

scene::Scene bent_beam(double degrees) {
  const double angle = kDegree * degrees;
  scene::Scene scene = beam_without_targets();
  const auto& nodes = scene.mesh.nodes;
  const double left = nodes.row(0).minCoeff(), length = nodes.row(0).maxCoeff() - left;
  for (const double share : {1.0 / 3, 2.0 / 3, 1.0}) {
    Index node = 0;
    (nodes.row(0).array() - left - share * length).abs().minCoeff(&node);
    const double along = nodes(0, node) - left, turn = angle * along / length;
    const double radius = length / angle;
    scene::Constraint constraint;
    constraint.frame = 100;
    constraint.nodes = {static_cast<int>(node)};
    constraint.target =
        Eigen::Vector3d(radius * std::sin(turn) - along, radius * (1 - std::cos(turn)), 0);
    scene.constraints.push_back(constraint);
  }
  return scene;
}

scene::Scene twisted_beam(double degrees) {
  const double angle = kDegree * degrees;
  scene::Scene scene = beam_without_targets();
  const auto& nodes = scene.mesh.nodes;
  const double end = nodes.row(0).maxCoeff();
  const double middle_y = (nodes.row(1).maxCoeff() + nodes.row(1).minCoeff()) / 2;
  const double middle_z = (nodes.row(2).maxCoeff() + nodes.row(2).minCoeff()) / 2;
  int corners = 0;
  for (Index i = 0; i < nodes.cols() && corners < 4; ++i) {
    const double y = nodes(1, i) - middle_y, z = nodes(2, i) - middle_z;
    const bool is_corner = nodes(0, i) > end - 1e-9 &&
                           std::abs(y) > 0.999 * (nodes.row(1).maxCoeff() - middle_y) &&
                           std::abs(z) > 0.999 * (nodes.row(2).maxCoeff() - middle_z);
    if (!is_corner) continue;
    ++corners;
    scene::Constraint constraint;
    constraint.frame = 100;
    constraint.nodes = {static_cast<int>(i)};
    const double c = std::cos(angle), s = std::sin(angle);
    constraint.target = Eigen::Vector3d(0, c * y - s * z - y, s * y + c * z - z);
    scene.constraints.push_back(constraint);
  }
  return scene;
}

}  // namespace limber::bench
