#include "engine/rods/linkage/joint_pairing.h"

#include <fmt/format.h>

#include <limits>

#include "engine/base/error.h"

namespace limber::rods::detail {
namespace {

// A bend this close to a full turn back leaves nothing of the tangent.
constexpr double kLeastTangent = 1e-6;

using Partition = std::array<std::vector<int>, 2>;

std::vector<Partition> partitions(std::size_t valence) {
  switch (valence) {
    case 2:
      return {{{{0}, {1}}}};
    case 3:
      return {{{{0, 1}, {2}}}, {{{0, 2}, {1}}}, {{{1, 2}, {0}}}};
    default:
      return {{{{0, 1}, {2, 3}}}, {{{0, 2}, {1, 3}}}, {{{0, 3}, {1, 2}}}};
  }
}

/// Sum of the cosines between the directions of a rod's two spokes: -1 for each straight rod.
double bend(const Partition& partition, const std::vector<Spoke>& spokes) {
  double sum = 0;
  for (const std::vector<int>& rod : partition) {
    if (rod.size() == 2) sum += spokes[rod[0]].direction.dot(spokes[rod[1]].direction);
  }
  return sum;
}

}  // namespace

RodPair pair_spokes(const std::vector<Spoke>& spokes, int vertex) {
  LIMBER_DEMAND(spokes.size() >= 2 && spokes.size() <= 4);
  Partition best;
  double least = std::numeric_limits<double>::infinity();
  for (const Partition& partition : partitions(spokes.size())) {
    const double value = bend(partition, spokes);
    if (value < least) {
      least = value;
      best = partition;
    }
  }
  RodPair pair;
  for (int r = 0; r < 2; ++r) {
    for (const int spoke : best[r]) pair.rods[r].push_back(spokes[spoke]);
    Eigen::Vector3d tangent = pair.rods[r][0].direction;
    if (pair.rods[r].size() == 2) tangent -= pair.rods[r][1].direction;
    if (tangent.norm() < kLeastTangent) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("vertices[{}]", vertex),
                  fmt::format("edges {} and {} leave the joint at vertex {} in the same direction: "
                              "the rod they form has no tangent",
                              pair.rods[r][0].segment, pair.rods[r][1].segment, vertex));
    }
    pair.tangents[r] = tangent.normalized();
  }
  return pair;
}

}  // namespace limber::rods::detail
