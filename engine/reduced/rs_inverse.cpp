#include "engine/reduced/rs_inverse.h"

#include <algorithm>
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
  // Principal logarithms and strains first: independent of each other.
  parallel_for(count, kTetsPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (auto e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
      const rotations::Polar polar =
          rotations::polar_decomposition(gradient_.apply(u, e) + Eigen::Matrix3d::Identity());
      const Eigen::Matrix3d strain = polar.stretch - Eigen::Matrix3d::Identity();
      auto y_e = y.segment<kRsSize>(kRsSize * e);
      y_e = rs_of_gradient(strain);
      y_e.head<3>() = rotations::logarithm(polar.rotation);
    }
  });

  const auto theta = [&](int e) { return y.segment<3>(kRsSize * e); };
  const auto reference = [&](int e, int source) -> Eigen::Vector3d {
    if (source == kFromRest) return Eigen::Vector3d::Zero();
    if (source == kFromPrevious) return previous->segment<3>(kRsSize * e);
    return theta(source);
  };
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
  const auto offer = [&](int e, int source) {
    const Eigen::Vector3d from = reference(e, source);
    const Eigen::Vector3d principal = theta(e);
    steps.push({(rotations::nearest_branch(principal, from) - from).norm(), e, source});
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
      if (by_angle.empty()) {
        for (int e = 0; e < count; ++e) {
          if (!settled[e]) by_angle.push_back(e);
        }
        std::sort(by_angle.begin(), by_angle.end(), [&](int a, int b) {
          return std::make_tuple(theta(a).squaredNorm(), a) <
                 std::make_tuple(theta(b).squaredNorm(), b);
        });
      }
      while (settled[by_angle[next_seed]]) ++next_seed;
      offer(by_angle[next_seed], kFromRest);
    }
    const Step step = steps.top();
    steps.pop();
    if (settled[step.tet]) continue;
    const Eigen::Vector3d principal = theta(step.tet);
    theta(step.tet) = rotations::nearest_branch(principal, reference(step.tet, step.source));
    settled[step.tet] = 1;
    --left;
    for (int neighbour : neighbours_[step.tet]) {
      if (neighbour >= 0 && !settled[neighbour]) offer(neighbour, step.tet);
    }
  }
  return y;
}

}  // namespace limber::reduced
