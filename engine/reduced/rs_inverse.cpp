#include "engine/reduced/rs_inverse.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/rotations/logarithm.h"
#include "engine/base/rotations/polar.h"
#include "engine/bodies/tet_faces.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {
namespace {

constexpr int kTetsPerChunk = 512;

std::vector<std::array<int, 4>> face_neighbours(const bodies::TetNodes& tets) {
  struct Face {
    std::array<int, 3> nodes;
    int tet, face;
  };
  std::vector<Face> faces;
  faces.reserve(static_cast<std::size_t>(tets.cols()) * 4);
  for (int e = 0; e < static_cast<int>(tets.cols()); ++e) {
    for (int f = 0; f < 4; ++f) {
      Face face{{}, e, f};
      for (int k = 0; k < 3; ++k) face.nodes[k] = tets(bodies::kTetFaces[f][k], e);
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return std::tie(a.nodes, a.tet, a.face) < std::tie(b.nodes, b.tet, b.face);
  });
  std::vector<std::array<int, 4>> result(tets.cols(), {-1, -1, -1, -1});
  for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
    if (faces[i].nodes != faces[i + 1].nodes) continue;
    result[faces[i].tet][faces[i].face] = faces[i + 1].tet;
    result[faces[i + 1].tet][faces[i + 1].face] = faces[i].tet;
  }
  return result;
}

struct Step {
  double size;
  int tet;
  int source;  // a settled tet, or one of the two below
  bool operator>(const Step& other) const {
    return std::tie(size, tet, source) > std::tie(other.size, other.tet, other.source);
  }
};
constexpr int kFromRest = -1;
constexpr int kFromPrevious = -2;

constexpr double kTurn = 2 * 3.14159265358979323846;

/// Beyond most of a first turn [rad] ...
constexpr double kFirstTurn = 4.0;
/// ... a tet hands on its own theta only if it is this far from a full turn and this near to what
/// was expected.
constexpr double kClearOfFullTurn = 1.0;
constexpr double kNearBranch = 1.0;

/// The logarithm for a tet expected to have `expected`. Past the first turn the number of turns is
/// kept even where the axis is far from the expected one, where the nearest branch would be the
/// one with no turn at all.
Eigen::Vector3d branch_for(const Eigen::Vector3d& principal, const Eigen::Vector3d& expected) {
  const double angle = principal.norm(), wanted = expected.norm();
  if (wanted < kFirstTurn || angle < 1e-13) return rotations::nearest_branch(principal, expected);
  const double along = principal.dot(expected) >= 0 ? angle : -angle;
  const double turns = std::max(0.0, std::round((wanted - along) / kTurn));
  return principal * ((along + turns * kTurn) / along);
}

/// A theta of the frame before that is no guide as long as a neighbour is one.
bool next_to_full_turn(const Eigen::Vector3d& theta) {
  const double angle = theta.norm();
  return angle > kFirstTurn && std::abs(std::remainder(angle, kTurn)) < kClearOfFullTurn;
}
constexpr double kLast = 100;  // added to a step, makes it one of the last resort

/// `from` turned on by the part about its own axis of the rotation between two neighbours.
Eigen::Vector3d count_on(const Eigen::Vector3d& from, const Eigen::Quaterniond& here,
                         const Eigen::Quaterniond& there) {
  const double angle = from.norm();
  if (angle < kFirstTurn) return from;
  const Eigen::Vector3d axis = from / angle;
  const Eigen::Vector3d between = rotations::logarithm((there * here.conjugate()).normalized());
  return from + between.dot(axis) * axis;
}

std::vector<int> least_turned_first(const Eigen::VectorXd& y) {
  std::vector<int> result(static_cast<std::size_t>(y.size() / kRsSize));
  for (std::size_t e = 0; e < result.size(); ++e) result[e] = static_cast<int>(e);
  std::sort(result.begin(), result.end(), [&](int a, int b) {
    const double angle_a = y.segment<3>(kRsSize * a).norm();
    const double angle_b = y.segment<3>(kRsSize * b).norm();
    return angle_a < angle_b || (angle_a == angle_b && a < b);
  });
  return result;
}

}  // namespace

RsInverse::RsInverse(const bodies::ElasticBody& body, const bodies::GradientOperator& gradient)
    : gradient_(gradient),
      neighbours_(face_neighbours(gradient.tets())),
      at_fixed_node_(static_cast<std::size_t>(gradient.tet_count()), 0) {
  std::vector<char> fixed(static_cast<std::size_t>(gradient.node_count()), 0);
  for (int node : body.fixed_nodes) fixed[node] = 1;
  for (int e = 0; e < gradient.tet_count(); ++e) {
    for (int a = 0; a < 4; ++a) at_fixed_node_[e] |= fixed[gradient.tets()(a, e)];
  }
}

Eigen::VectorXd RsInverse::coordinates(const Eigen::Ref<const Eigen::VectorXd>& u) const {
  return settle(u, nullptr);
}

Eigen::VectorXd RsInverse::coordinates(const Eigen::Ref<const Eigen::VectorXd>& u,
                                       const Eigen::VectorXd& previous) const {
  LIMBER_DEMAND(previous.size() == kRsSize * gradient_.tet_count());
  return settle(u, &previous);
}

Eigen::VectorXd RsInverse::settle(const Eigen::Ref<const Eigen::VectorXd>& u,
                                  const Eigen::VectorXd* previous) const {
  const int count = gradient_.tet_count();
  Eigen::VectorXd y(kRsSize * count);
  std::vector<Eigen::Quaterniond> rotation(static_cast<std::size_t>(count));
  // Principal logarithms and strains first: independent of each other.
  parallel_for(count, kTetsPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (auto e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
      const rotations::Polar polar =
          rotations::polar_decomposition(gradient_.apply(u, e) + Eigen::Matrix3d::Identity());
      auto y_e = y.segment<kRsSize>(kRsSize * e);
      y_e = rs_of_gradient(polar.stretch - Eigen::Matrix3d::Identity());
      y_e.head<3>() = rotations::logarithm(polar.rotation);
      rotation[e] = polar.rotation;
    }
  });

  const auto theta = [&](int e) { return y.segment<3>(kRsSize * e); };
  Eigen::Matrix3Xd counted(3, count);  // what a settled tet hands on
  const auto reference = [&](int e, int source) -> Eigen::Vector3d {
    if (source == kFromRest) return Eigen::Vector3d::Zero();
    if (source == kFromPrevious) return previous->segment<3>(kRsSize * e);
    return count_on(counted.col(source), rotation[source], rotation[e]);
  };
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
  const auto offer = [&](int e, int source) {
    const Eigen::Vector3d from = reference(e, source);
    const Eigen::Vector3d principal = theta(e);
    double size = (branch_for(principal, from) - from).norm();
    if (source == kFromPrevious && next_to_full_turn(from)) size += kLast;
    steps.push({size, e, source});
  };
  for (int e = 0; e < count; ++e) {
    if (previous != nullptr) offer(e, kFromPrevious);
    if (previous == nullptr && at_fixed_node_[e]) offer(e, kFromRest);
  }

  std::vector<char> settled(static_cast<std::size_t>(count), 0);
  std::vector<int> by_angle;  // seeds of pieces that no fixed node reaches, least turned first
  std::size_t next_seed = 0;
  for (int left = count; left > 0;) {
    if (steps.empty()) {
      if (by_angle.empty()) by_angle = least_turned_first(y);
      while (settled[by_angle[next_seed]]) ++next_seed;
      offer(by_angle[next_seed], kFromRest);
    }
    const Step step = steps.top();
    steps.pop();
    if (settled[step.tet]) continue;
    const Eigen::Vector3d principal = theta(step.tet);
    const Eigen::Vector3d expected = reference(step.tet, step.source);
    theta(step.tet) = branch_for(principal, expected);
    const bool near =
        expected.norm() < kFirstTurn ||
        ((theta(step.tet) - expected).norm() < kNearBranch && principal.norm() > kClearOfFullTurn);
    counted.col(step.tet) = near ? Eigen::Vector3d(theta(step.tet)) : expected;
    settled[step.tet] = 1;
    --left;
    for (int neighbour : neighbours_[step.tet]) {
      if (neighbour >= 0 && !settled[neighbour]) offer(neighbour, step.tet);
    }
  }
  return y;
}

}  // namespace limber::reduced
