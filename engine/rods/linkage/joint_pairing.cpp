#include "engine/rods/linkage/joint_pairing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::rods::detail {
namespace {

// A bend this close to a full turn back leaves nothing of the tangent.
constexpr double kLeastTangent = 1e-6;
// Added to the bend of pairs that fold back: more than any mesh can save by it.
constexpr double kFold = 1e6;

std::vector<Pairing> partitions(std::size_t valence) {
  switch (valence) {
    case 2:
      return {{{{{0}, {1}}}}};
    case 3:
      return {{{{{0, 1}, {2}}}}, {{{{0, 2}, {1}}}}, {{{{1, 2}, {0}}}}};
    default:
      return {{{{{0, 1}, {2, 3}}}}, {{{{0, 2}, {1, 3}}}}, {{{{0, 3}, {1, 2}}}}};
  }
}

void measure(const std::vector<Spoke>& spokes, Pairing& pairing) {
  for (const std::vector<int>& rod : pairing.rods) {
    if (rod.size() < 2) continue;
    const double cosine = spokes[rod[0]].direction.dot(spokes[rod[1]].direction);
    pairing.bend += cosine;
    pairing.turn = std::max(pairing.turn, std::acos(std::clamp(-cosine, -1.0, 1.0)));
  }
}

bool folds_back(const Pairing& pairing, const std::vector<Spoke>& spokes) {
  return std::any_of(pairing.rods.begin(), pairing.rods.end(), [&](const std::vector<int>& rod) {
    return rod.size() == 2 &&
           (spokes[rod[0]].direction - spokes[rod[1]].direction).norm() < kLeastTangent;
  });
}

/// By which pairings of equal bend are ordered, independent of the order of the spokes.
int rank_of(const Pairing& pairing, const std::vector<int>& ranks) {
  if (ranks.size() == 3) return ranks[pairing.rods[1][0]];
  const auto first = static_cast<int>(std::min_element(ranks.begin(), ranks.end()) - ranks.begin());
  for (const std::vector<int>& rod : pairing.rods) {
    if (rod.size() != 2) continue;
    if (rod[0] == first) return ranks[rod[1]];
    if (rod[1] == first) return ranks[rod[0]];
  }
  return 0;
}

}  // namespace

std::vector<Pairing> possible_pairings(const std::vector<Spoke>& spokes,
                                       const std::vector<int>& ranks) {
  LIMBER_DEMAND(spokes.size() >= 2 && spokes.size() <= 4 && ranks.size() == spokes.size());
  std::vector<Pairing> all = partitions(spokes.size());
  for (Pairing& pairing : all) {
    measure(spokes, pairing);
    if (folds_back(pairing, spokes)) pairing.bend += kFold;
  }
  std::sort(all.begin(), all.end(), [&](const Pairing& a, const Pairing& b) {
    return a.bend != b.bend ? a.bend < b.bend : rank_of(a, ranks) < rank_of(b, ranks);
  });
  const double most = all.front().turn + kLargestTurn;
  all.erase(std::remove_if(all.begin() + 1, all.end(),
                           [&](const Pairing& pairing) { return pairing.turn > most; }),
            all.end());
  return all;
}

RodPair form_rods(const std::vector<Spoke>& spokes, const Pairing& pairing, int vertex) {
  RodPair pair;
  for (int r = 0; r < 2; ++r) {
    for (const int spoke : pairing.rods[r]) pair.rods[r].push_back(spokes[spoke]);
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
