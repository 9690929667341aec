#include "engine/reduced/pose_sampling.h"

#include <algorithm>
#include <cmath>

namespace limber::reduced {
namespace {

double draw_level(PoseLevels levels, int pose, Random& random) {
  switch (levels) {
    case PoseLevels::kTraining:
      return pose % 4 == 0 ? 0.003 * std::pow(100.0, random.uniform()) : random.uniform(0.1, 1.25);
    case PoseLevels::kTest:
      return random.uniform(0.2, 1);
    case PoseLevels::kSmall:
      return 0.01;
  }
  return 0;
}

Eigen::Vector3d random_direction(Random& random) {
  Eigen::Vector3d direction;
  do {
    for (int k = 0; k < 3; ++k) direction[k] = random.normal();
  } while (direction.norm() < 1e-3);
  return direction.normalized();
}

}  // namespace

Eigen::MatrixXd sample_poses(const ScaledModes& modes, double body_length, double amplitude,
                             PoseLevels levels, int count, Random& random) {
  constexpr double kLargestTurn = 1.5;  // of a sampled pose [rad]
  const int rigid = modes.rigid_count;
  const double lowest =
      modes.eigenvalues[reference_mode(modes.count(), rigid, modes.mechanism_count)];
  const Eigen::VectorXd relative =
      (modes.eigenvalues.tail(modes.elastic_count()) / lowest).cwiseMax(1.0);
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(modes.count(), count);
  Eigen::VectorXd level(count);
  for (int s = 0; s < count; ++s) {
    level[s] = draw_level(levels, s, random);
    const double decay = random.uniform(0, 0.5);
    for (int k = 0; k < modes.elastic_count(); ++k) {
      z(rigid + k, s) = random.normal() * (s % 2 == 0 ? 1.0 : std::pow(relative[k], -decay));
    }
  }
  // One scale for all: the typical pose has the requested amplitude. A pose that happens to have
  // little of the low modes is a small pose, not one with enormous high modes.
  const int sample = std::min(count, 128);
  const Eigen::MatrixXd u = modes.modes.rightCols(modes.elastic_count()) *
                            z.block(rigid, 0, modes.elastic_count(), sample);
  Eigen::VectorXd largest = largest_node_displacement(u);
  std::nth_element(largest.data(), largest.data() + sample / 2, largest.data() + sample);
  const double typical = largest[sample / 2];
  z = (z * (amplitude * body_length / typical * level).asDiagonal()).eval();
  if (rigid > 0) {
    for (int s = 0; s < count; ++s) {
      z.col(s).segment<3>(3) =
          level[s] * kLargestTurn * random.uniform() * random_direction(random);
    }
  }
  return z;
}

}  // namespace limber::reduced
