#include "engine/reduced/rs_inverse.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/rotations/logarithm.h"
#include "engine/base/rotations/polar.h"
#include "engine/bodies/tet_faces.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {
namespace {

constexpr int kTetsPerChunk = 512;  // of one parallel chunk

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
constexpr int kFromRest = -1;    // source of a tet that starts from rest
constexpr int kFromBefore = -2;  // the tet itself in the frame before

/// Beyond most of a first turn [rad] ...
constexpr double kFirstTurn = 4.0;
/// ... a tet passes on its own theta only if it is this far from a full turn and this near to the
/// expected one.
constexpr double kClearOfFullTurn = 1.0;
constexpr double kNearBranch = 1.0;  // [rad]

/// The logarithm for a tet expected to have `expected`. Past the first turn the number of turns is
/// kept even if the axis is far from the expected one. The nearest branch would then be the one
/// without a turn.
Eigen::Vector3d branch_for(const Eigen::Vector3d& principal, const Eigen::Vector3d& expected) {
  const double angle = principal.norm(), expected_angle = expected.norm();
  if (expected_angle < kFirstTurn || angle < 1e-13)
    return rotations::nearest_branch(principal, expected);
  const double along = principal.dot(expected) >= 0 ? angle : -angle;
  const double turns = std::max(0.0, std::round((expected_angle - along) / kFullTurn));
  return principal * ((along + turns * kFullTurn) / along);
}

/// An expected theta of the frame before is no guide here as long as a neighbour is one.
bool next_to_full_turn(const Eigen::Vector3d& theta) {
  const double angle = theta.norm();
  return angle > kFirstTurn && std::abs(std::remainder(angle, kFullTurn)) < kClearOfFullTurn;
}
constexpr double kLast = 100;  // added to a step, makes it one of the last resort

/// `from` (at least `counts_from` long) turned on about its own axis to the angle that `rotation`
/// has about it (its twist), the nearest full turn of it. Not a sum of the steps along the path:
/// those of a wobble that goes round, about other axes, add up to an angle although it comes back.
Eigen::Vector3d count_on(const Eigen::Vector3d& from, const Eigen::Quaterniond& rotation,
                         double counts_from) {
  const double angle = from.norm();
  if (angle < counts_from) return from;
  const Eigen::Vector3d axis = from / angle;
  const double twist = 2 * std::atan2(rotation.vec().dot(axis), rotation.w());
  return (angle + std::remainder(twist - angle, kFullTurn)) * axis;
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

/// Principal logarithms and strains (into y), and the tets' rotations.
std::vector<Eigen::Quaterniond> principal_coordinates(const bodies::GradientOperator& gradient,
                                                      const Eigen::Ref<const Eigen::VectorXd>& u,
                                                      Eigen::VectorXd& y) {
  const int count = gradient.tet_count();
  y.resize(kRsSize * Eigen::Index{count});
  std::vector<Eigen::Quaterniond> rotation(static_cast<std::size_t>(count));
  parallel_for(count, kTetsPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (auto e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
      const rotations::Polar polar =
          rotations::polar_decomposition(gradient.apply(u, e) + Eigen::Matrix3d::Identity());
      auto y_e = y.segment<kRsSize>(kRsSize * e);
      y_e = rs_of_gradient(polar.stretch - Eigen::Matrix3d::Identity());
      y_e.head<3>() = rotations::logarithm(polar.rotation);
      rotation[e] = polar.rotation;
    }
  });
  return rotation;
}

/// One frame's choice of branches, from settled tet to tet.
class Branches {
 public:
  /// @param y  principal logarithms, replaced by the branches chosen
  Branches(const std::vector<std::array<int, 4>>& neighbours,
           const std::vector<Eigen::Quaterniond>& rotation, const RsTrack& before,
           Eigen::VectorXd& y)
      : neighbours_(neighbours),
        rotation_(rotation),
        before_(before),
        y_(y),
        counted_(3, static_cast<Eigen::Index>(rotation.size())) {}

  void offer(int e, int source) {
    const Eigen::Vector3d from = expected(e, source);
    const Eigen::Vector3d principal = theta(e);
    double size = (branch_for(principal, from) - from).norm();
    if (source == kFromBefore && next_to_full_turn(from)) size += kLast;
    steps_.push({size, e, source});
  }

  /// What the tets hand on.
  Eigen::Matrix3Xd settle() {
    std::vector<char> settled(rotation_.size(), 0);
    std::vector<int> by_angle;  // seeds of pieces that no fixed node reaches, least turned first
    std::size_t next_seed = 0;
    for (std::size_t left = rotation_.size(); left > 0;) {
      if (steps_.empty()) {
        if (by_angle.empty()) by_angle = least_turned_first(y_);
        while (settled[by_angle[next_seed]]) ++next_seed;
        offer(by_angle[next_seed], kFromRest);
      }
      const Step step = steps_.top();
      steps_.pop();
      if (settled[step.tet]) continue;
      choose(step.tet, expected(step.tet, step.source));
      settled[step.tet] = 1;
      --left;
      for (int neighbour : neighbours_[step.tet]) {
        if (neighbour >= 0 && !settled[neighbour]) offer(neighbour, step.tet);
      }
    }
    return std::move(counted_);
  }

 private:
  Eigen::VectorXd::FixedSegmentReturnType<3>::Type theta(int e) {
    return y_.segment<3>(kRsSize * Eigen::Index{e});
  }

  Eigen::Vector3d expected(int e, int source) const {
    if (source == kFromRest) return Eigen::Vector3d::Zero();
    if (source == kFromBefore) {
      // Steps in time may be long: counted as soon as there is an axis.
      return count_on(before_.counted.col(e), rotation_[e], kClearOfFullTurn);
    }
    return count_on(counted_.col(source), rotation_[e], kFirstTurn);
  }

  void choose(int e, const Eigen::Vector3d& expected) {
    const Eigen::Vector3d principal = theta(e);
    const Eigen::Vector3d branch = branch_for(principal, expected);
    const bool near = expected.norm() < kFirstTurn || ((branch - expected).norm() < kNearBranch &&
                                                       principal.norm() > kClearOfFullTurn);
    theta(e) = branch;
    counted_.col(e) = near ? branch : expected;
  }

  const std::vector<std::array<int, 4>>& neighbours_;
  const std::vector<Eigen::Quaterniond>& rotation_;
  const RsTrack& before_;
  Eigen::VectorXd& y_;
  Eigen::Matrix3Xd counted_;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps_;
};

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
  RsTrack track;
  return coordinates(u, track);
}

Eigen::VectorXd RsInverse::coordinates(const Eigen::Ref<const Eigen::VectorXd>& u,
                                       RsTrack& track) const {
  const int count = gradient_.tet_count();
  const bool first = track.counted.cols() == 0;
  LIMBER_DEMAND(first || track.counted.cols() == count);
  Eigen::VectorXd y;
  const std::vector<Eigen::Quaterniond> rotation = principal_coordinates(gradient_, u, y);
  Branches branches(neighbours_, rotation, track, y);
  for (int e = 0; e < count; ++e) {
    if (!first) branches.offer(e, kFromBefore);
    if (first && at_fixed_node_[e]) branches.offer(e, kFromRest);
  }
  track.counted = branches.settle();
  return y;
}

}  // namespace limber::reduced
