#include "engine/rods/linkage/pairing_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "engine/rods/linkage/odd_cycle.h"
#include "engine/rods/linkage/parity_forest.h"

namespace limber::rods::detail {
namespace {

/// Joints and the segments between them, with bends of pairings that no drawing need have.
struct Network {
  int segments = 0;
  std::vector<JointChoices> joints;

  [[nodiscard]] std::vector<int> vertices() const {
    std::vector<int> numbers(joints.size());
    std::iota(numbers.begin(), numbers.end(), 0);
    return numbers;
  }
};

double random_number(std::mt19937& random) {
  return static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
}

void give_pairings(Network& network, std::mt19937& random) {
  for (JointChoices& joint : network.joints) {
    std::vector<Spoke> spokes;
    std::vector<int> ranks;
    for (const int segment : joint.segments) {
      spokes.push_back({segment, kStart, Eigen::Vector3d::UnitX()});
      ranks.push_back(segment);
    }
    joint.pairings = possible_pairings(spokes, ranks);
    for (Pairing& pairing : joint.pairings) pairing.bend = 4 * random_number(random) - 2;
    std::sort(joint.pairings.begin(), joint.pairings.end(),
              [](const Pairing& a, const Pairing& b) { return a.bend < b.bend; });
  }
}

/// Every joint with two to four segments, at random; about one in ten ends in a free end.
Network random_network(int joints, std::mt19937& random, bool has_free_ends) {
  for (;;) {
    Network network;
    network.joints.resize(static_cast<std::size_t>(joints));
    std::vector<int> ends;
    for (int j = 0; j < joints; ++j) {
      const int valence =
          has_free_ends ? 2 + static_cast<int>(random() % 3) : (random() % 5 > 0 ? 4 : 2);
      ends.insert(ends.end(), static_cast<std::size_t>(valence), j);
    }
    for (std::size_t i = ends.size(); i-- > 1;) std::swap(ends[i], ends[random() % (i + 1)]);
    std::set<std::pair<int, int>> known;
    bool is_simple = true;
    while (!ends.empty() && is_simple) {
      const int a = ends.back();
      ends.pop_back();
      network.joints[a].segments.push_back(network.segments);
      if (!ends.empty() && !(has_free_ends && random() % 10 == 0)) {
        const int b = ends.back();
        ends.pop_back();
        network.joints[b].segments.push_back(network.segments);
        is_simple = a != b && known.insert(std::minmax(a, b)).second;
      } else {
        is_simple = has_free_ends;
      }
      ++network.segments;
    }
    if (!is_simple) continue;
    give_pairings(network, random);
    return network;
  }
}

bool fits(const Network& network, const std::vector<int>& pairings) {
  ParityForest forest(static_cast<std::size_t>(network.segments));
  for (std::size_t j = 0; j < network.joints.size(); ++j) {
    const JointChoices& joint = network.joints[j];
    const Pairing& pairing = joint.pairings[pairings[j]];
    for (int r = 0; r < 2; ++r)
      for (const int spoke : pairing.rods[r])
        if (!forest.join(joint.segments[pairing.rods[0][0]], joint.segments[spoke], r))
          return false;
  }
  return true;
}

double cost(const Network& network, const std::vector<int>& pairings) {
  double sum = 0;
  for (std::size_t j = 0; j < network.joints.size(); ++j)
    sum += network.joints[j].pairings[pairings[j]].bend - network.joints[j].pairings[0].bend;
  return sum;
}

/// By trying all; infinite where none fits.
double least_cost(const Network& network) {
  std::vector<int> pairings(network.joints.size(), 0);
  double least = std::numeric_limits<double>::infinity();
  for (;;) {
    const double value = cost(network, pairings);
    if (value < least && fits(network, pairings)) least = value;
    std::size_t j = 0;
    while (j < pairings.size() &&
           ++pairings[j] == static_cast<int>(network.joints[j].pairings.size()))
      pairings[j++] = 0;
    if (j == pairings.size()) return least;
  }
}

TEST(PairingChoice, IsTheLeastOfAllPairingsOfSmallNetworks) {
  std::mt19937 random(7);
  int bent = 0, mixed = 0;
  for (int round = 0; round < 300; ++round) {
    const Network network =
        random_network(4 + static_cast<int>(random() % 5), random, round % 2 == 0);
    const double least = least_cost(network);
    const PairingChoice choice = choose_pairings(network.segments, network.joints);
    EXPECT_TRUE(choice.is_least);
    if (choice.is_mixed) {
      ++mixed;
      EXPECT_EQ(least, std::numeric_limits<double>::infinity()) << "round " << round;
      EXPECT_EQ(choice.bent, 0);
      continue;
    }
    EXPECT_TRUE(fits(network, choice.pairings)) << "round " << round;
    EXPECT_NEAR(cost(network, choice.pairings), least, 1e-12) << "round " << round;
    bent += choice.bent > 0 ? 1 : 0;
  }
  EXPECT_GT(bent, 100);  // most are no case for the straightest
  EXPECT_GT(mixed, 10);
}

TEST(PairingChoice, DoesNotDependOnTheOrderOfSpokes) {
  std::mt19937 random(11);
  for (int round = 0; round < 30; ++round) {
    Network network = random_network(12, random, true);
    const PairingChoice choice = choose_pairings(network.segments, network.joints);
    std::vector<int> numbers(static_cast<std::size_t>(network.segments));
    std::iota(numbers.begin(), numbers.end(), 0);
    std::reverse(numbers.begin(), numbers.end());
    for (JointChoices& joint : network.joints)
      for (int& segment : joint.segments) segment = numbers[segment];
    EXPECT_EQ(choose_pairings(network.segments, network.joints).pairings, choice.pairings);
  }
}

/// No cut of such a network is narrow: what is proven is that letters exist.
TEST(PairingChoice, ThousandJointsInATangleAreStillPaired) {
  std::mt19937 random(3);
  const Network network = random_network(1000, random, true);
  const PairingChoice choice = choose_pairings(network.segments, network.joints);
  EXPECT_TRUE(fits(network, choice.pairings));
  EXPECT_FALSE(choice.is_least);
}

TEST(PairingChoice, OfAllPairingsNoneFitOnlyInClosedPartsOfAnOddNumberOfSegments) {
  std::mt19937 random(5);
  for (int round = 0; round < 40; ++round) {
    const Network network = random_network(30, random, false);
    ParityForest forest(static_cast<std::size_t>(network.segments));
    for (const JointChoices& joint : network.joints)
      for (const int segment : joint.segments) {
        const auto a = forest.root(joint.segments[0]), b = forest.root(segment);
        (void)(a.item != b.item && forest.join(a.item, b.item, 0));
      }
    std::vector<int> sizes(static_cast<std::size_t>(network.segments), 0);
    for (int s = 0; s < network.segments; ++s) ++sizes[forest.root(s).item];
    const bool is_odd =
        std::any_of(sizes.begin(), sizes.end(), [](int size) { return size % 2 == 1; });
    const PairingChoice choice = choose_pairings(network.segments, network.joints);
    EXPECT_EQ(choice.is_mixed, is_odd) << "round " << round;
    EXPECT_NE(fits(network, choice.pairings), is_odd) << "round " << round;
  }
}

/// One candidate for each joint, and a part that these allow no letters beside one that they do.
TEST(PairingChoice, WithoutLettersAPartKeepsItsStraightestPairings) {
  std::mt19937 random(31);
  int mixed = 0;
  for (int round = 0; round < 200; ++round) {
    Network network = random_network(8, random, true);
    for (JointChoices& joint : network.joints) joint.pairings.resize(1);
    const PairingChoice choice = choose_pairings(network.segments, network.joints);
    EXPECT_EQ(choice.pairings, std::vector<int>(network.joints.size(), 0));
    EXPECT_EQ(choice.is_mixed, !fits(network, choice.pairings));
    mixed += choice.is_mixed ? 1 : 0;
  }
  EXPECT_GT(mixed, 20);
  EXPECT_LT(mixed, 200);
}

/// A grid too wide for any frontier, in which a few joints say that their rods turn.
TEST(PairingChoice, FewWrongJointsOfALargeGridBendFewRods) {
  constexpr int kSide = 300, kWrong = 20;
  Network network;
  const auto along = [](int row, int column) { return row * (kSide + 1) + column; };
  const auto across = [&](int row, int column) {
    return kSide * (kSide + 1) + row * kSide + column;
  };
  network.segments = 2 * kSide * (kSide + 1);
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      network.joints.push_back({{along(row, column), along(row, column + 1), across(row, column),
                                 across(row + 1, column)},
                                {}});
  std::mt19937 random(29);
  give_pairings(network, random);
  for (JointChoices& joint : network.joints) {
    for (Pairing& pairing : joint.pairings)
      pairing.bend = pairing.rods[0] == std::vector<int>{0, 1} ? -2 : random_number(random);
    std::sort(joint.pairings.begin(), joint.pairings.end(),
              [](const Pairing& a, const Pairing& b) { return a.bend < b.bend; });
  }
  for (int i = 0; i < kWrong; ++i) {
    std::vector<Pairing>& pairings = network.joints[random() % network.joints.size()].pairings;
    std::swap(pairings[0].bend, pairings[1].bend);
    std::swap(pairings[0], pairings[1]);
  }
  const PairingChoice choice = choose_pairings(network.segments, network.joints);
  EXPECT_TRUE(fits(network, choice.pairings));
  EXPECT_GT(choice.bent, 0);
  EXPECT_LE(choice.bent, kWrong);
}

/// Parts that none of the straightest pairings fit, many times over.
TEST(PairingChoice, EqualPartsAreChosenAlikeHoweverManyThereAre) {
  std::mt19937 random(17);
  Network one = random_network(6, random, true);
  while (fits(one, std::vector<int>(6, 0)) || least_cost(one) > 100)
    one = random_network(6, random, true);
  const PairingChoice alone = choose_pairings(one.segments, one.joints);
  Network many;
  constexpr int kCopies = 2000;
  for (int copy = 0; copy < kCopies; ++copy) {
    for (JointChoices joint : one.joints) {
      for (int& segment : joint.segments) segment += many.segments;
      many.joints.push_back(std::move(joint));
    }
    many.segments += one.segments;
  }
  const PairingChoice choice = choose_pairings(many.segments, many.joints);
  EXPECT_TRUE(choice.is_least);
  EXPECT_EQ(choice.bent, kCopies * alone.bent);
  for (std::size_t j = 0; j < many.joints.size(); ++j)
    EXPECT_EQ(choice.pairings[j], alone.pairings[j % 6]);
}

/// The shortest walk of a node and a parity back to the node, by repeated relaxation.
std::vector<std::size_t> odd_walk_lengths(int nodes, const std::vector<ParityLink>& links) {
  constexpr std::size_t kNone = 1000;
  std::vector<std::size_t> lengths;
  for (int start = 0; start < nodes; ++start) {
    std::vector<std::array<std::size_t, 2>> away(static_cast<std::size_t>(nodes), {kNone, kNone});
    away[start][0] = 0;
    for (int round = 0; round < 2 * nodes; ++round) {
      for (const ParityLink& link : links) {
        const auto [a, b] = link.nodes;
        for (const int parity : {0, 1}) {
          away[b][parity ^ link.parity] =
              std::min(away[b][parity ^ link.parity], away[a][parity] + 1);
          away[a][parity ^ link.parity] =
              std::min(away[a][parity ^ link.parity], away[b][parity] + 1);
        }
      }
    }
    lengths.push_back(away[start][1] < kNone ? away[start][1] : 0);
  }
  return lengths;
}

TEST(ShortestOddCycle, IsTheShortestThroughTheSmallestNodeOfRandomGraphs) {
  std::mt19937 random(23);
  int found = 0;
  for (int round = 0; round < 200; ++round) {
    const int nodes = 6 + static_cast<int>(random() % 12);
    std::vector<ParityLink> links;
    std::set<std::pair<int, int>> known;
    for (int i = 0; i < nodes + static_cast<int>(random() % 6); ++i) {
      const int a = static_cast<int>(random() % nodes), b = static_cast<int>(random() % nodes);
      if (a != b && known.insert(std::minmax(a, b)).second)
        links.push_back({{a, b}, random() % 4 == 0 ? 1 : 0});
    }
    const std::vector<std::size_t> lengths = odd_walk_lengths(nodes, links);
    std::size_t shortest = 0, through = 0;
    for (std::size_t node = 0; node < lengths.size(); ++node) {
      if (lengths[node] == 0 || (shortest > 0 && lengths[node] >= shortest)) continue;
      shortest = lengths[node];
      through = node;
    }
    const std::vector<int> cycle = shortest_odd_cycle(nodes, links);
    ASSERT_EQ(cycle.size(), shortest) << "round " << round;
    if (shortest == 0) continue;
    ++found;
    EXPECT_EQ(cycle.front(), static_cast<int>(through)) << "round " << round;
  }
  EXPECT_GT(found, 100);
}

TEST(ShortestOddCycle, IsFoundAmongLongerAndEvenOnes) {
  // A square with even parity, one with odd parity, and an odd triangle.
  const std::vector<ParityLink> links = {{{0, 1}, 1}, {{1, 2}, 0}, {{2, 3}, 1},
                                         {{3, 0}, 0}, {{2, 4}, 1}, {{4, 5}, 1},
                                         {{5, 3}, 0}, {{4, 6}, 0}, {{6, 5}, 0}};
  const std::vector<int> cycle = shortest_odd_cycle(7, links);
  EXPECT_THAT(cycle, ::testing::UnorderedElementsAre(4, 5, 6));
  EXPECT_TRUE(shortest_odd_cycle(4, {{{0, 1}, 1}, {{1, 2}, 1}, {{2, 0}, 0}}).empty());
}

}  // namespace
}  // namespace limber::rods::detail
