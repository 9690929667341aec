#include "engine/rods/linkage/joint_orientation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "engine/base/disjoint_sets.h"
#include "engine/base/error.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/rods/linkage/odd_cycle.h"
#include "engine/rods/linkage/parity_forest.h"

namespace limber::rods::detail {
namespace {

// Below this sine of the angle between its rods a joint's own normal is taken from its neighbours.
constexpr double kLeastSine = 1e-5;
// How far an opening angle may lie beyond 0 or pi where the neighbours are on that side [rad].
constexpr double kOvershoot = 0.3;
// Cosine between a normal and its neighbour's, carried along the segment, above which it is clear
// which of its two normals the neighbour has.
constexpr double kClear = 0.5;
constexpr std::size_t kMaxCorners = 6;  // of a cell of the grid

struct Neighbour {
  int joint;
  int link;
};

class Orientation {
 public:
  Orientation(const std::vector<RodPair>& pairs, const std::vector<JointLink>& links,
              const std::vector<JointPlace>& places)
      : pairs_(pairs), links_(links), places_(places), neighbours_(pairs.size()) {
    for (std::size_t i = 0; i < links.size(); ++i) {
      const auto [a, b] = links[i].joints;
      neighbours_[a].push_back({b, static_cast<int>(i)});
      neighbours_[b].push_back({a, static_cast<int>(i)});
    }
    for (std::vector<Neighbour>& neighbours : neighbours_) {
      std::sort(neighbours.begin(), neighbours.end(), [&](const auto& a, const auto& b) {
        return places[a.joint].rank < places[b.joint].rank;
      });
    }
    by_rank_.resize(pairs.size());
    std::iota(by_rank_.begin(), by_rank_.end(), 0);
    std::sort(by_rank_.begin(), by_rank_.end(),
              [&](int a, int b) { return places[a].rank < places[b].rank; });
  }

  JointOrientations run() {
    const std::size_t count = pairs_.size();
    result_ = {std::vector<Eigen::Vector3d>(count, Eigen::Vector3d::Zero()),
               std::vector<int>(count, 0), std::vector<double>(count, 0),
               std::vector<int>(count, 1)};
    find_axes();
    set_sides();
    set_letters();
    for (const std::vector<int>& joints : components()) {
      settle_normals(joints);
      settle_angles(joints);
    }
    return std::move(result_);
  }

 private:
  Eigen::Vector3d own_normal(int joint) const {
    return pairs_[joint].tangents[0].cross(pairs_[joint].tangents[1]);
  }
  bool is_open(int joint) const { return own_normal(joint).norm() > kLeastSine; }

  /// The normal of the joint at one end of a link, transported along the rod to the other.
  Eigen::Vector3d carried_normal(const JointLink& link, int end) const {
    const auto tangent = [&](int at) -> Eigen::Vector3d {
      const Eigen::Vector3d& t = pairs_[link.joints[at]].tangents[link.rods[at]];
      return t.dot(link.direction) < 0 ? Eigen::Vector3d(-t) : t;
    };
    return rotations::shortest_rotation(link.direction, tangent(1 - end)) *
           (rotations::shortest_rotation(tangent(end), link.direction) *
            result_.normals[link.joints[end]]);
  }

  /// Normals but for their sign. Those of closed joints come from the nearest open ones.
  void find_axes() {
    std::vector<char> known(pairs_.size(), 0);
    std::vector<int> order;
    const auto set = [&](int joint, const Eigen::Vector3d& normal) {
      known[joint] = 1;
      order.push_back(joint);
      result_.normals[joint] = normal.normalized();
    };
    const auto across = [&](int joint, const Eigen::Vector3d& hint) -> Eigen::Vector3d {
      const Eigen::Vector3d& t = pairs_[joint].tangents[0];
      const Eigen::Vector3d normal = hint - t * t.dot(hint);
      return normal.norm() < 1e-3 ? t.unitOrthogonal() : normal;
    };
    std::size_t next = 0;
    const auto spread = [&] {
      for (; next < order.size(); ++next) {
        const int joint = order[next];
        for (const Neighbour& neighbour : neighbours_[joint]) {
          if (known[neighbour.joint]) continue;
          const JointLink& link = links_[neighbour.link];
          set(neighbour.joint,
              across(neighbour.joint, carried_normal(link, link.joints[0] == joint ? 0 : 1)));
        }
      }
    };
    for (const int joint : by_rank_)
      if (is_open(joint)) set(joint, own_normal(joint));
    spread();
    for (const int joint : by_rank_) {
      if (known[joint]) continue;
      set(joint, across(joint, own_normal(joint)));
      spread();
    }
  }

  /// Which of the two normals each joint has.
  void set_sides() {
    cosines_.clear();
    for (const JointLink& link : links_)
      cosines_.push_back(carried_normal(link, 0).dot(result_.normals[link.joints[1]]));
    is_ignored_.assign(links_.size(), 0);
    ParityForest sides(pairs_.size());
    if (!join_sides(sides)) {
      ignore_crumpled_cells();
      sides = ParityForest(pairs_.size());
      (void)join_sides(sides);
    }
    std::vector<int> reference(pairs_.size(), -1);  // of each root: the side of an open joint
    for (const bool open : {true, false}) {
      for (std::size_t j = 0; j < pairs_.size(); ++j) {
        const auto [root, parity] = sides.root(static_cast<int>(j));
        if (reference[root] < 0 && is_open(static_cast<int>(j)) == open) reference[root] = parity;
      }
    }
    for (std::size_t j = 0; j < pairs_.size(); ++j) {
      const auto [root, parity] = sides.root(static_cast<int>(j));
      if (parity != reference[root]) result_.normals[j] = -result_.normals[j];
    }
  }

  /// The clearest links first. @returns whether all clear ones agree
  [[nodiscard]] bool join_sides(ParityForest& sides) const {
    std::vector<int> order(links_.size());
    std::iota(order.begin(), order.end(), 0);
    const auto key = [&](int i) {
      const auto [a, b] = links_[i].joints;
      return std::tuple(is_ignored_[i], -std::abs(cosines_[i]),
                        std::minmax({places_[a].rank, places_[b].rank}));
    };
    std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
    bool agree = true;
    for (const int i : order) {
      const auto [a, b] = links_[i].joints;
      if (!sides.join(a, b, cosines_[i] < 0 ? 1 : 0) && is_clear(i)) agree = false;
    }
    return agree;
  }

  [[nodiscard]] bool is_clear(int link) const {
    return is_ignored_[link] == 0 && std::abs(cosines_[link]) > kClear;
  }

  /// A loop around one cell of the grid, or a rectangle of them, bounds a piece of the surface,
  /// however crumpled that is: its least clear link says nothing. Other loops that contradict
  /// themselves have one side.
  void ignore_crumpled_cells() {
    std::vector<int> place(pairs_.size());  // in the order by rank
    for (std::size_t i = 0; i < by_rank_.size(); ++i) place[by_rank_[i]] = static_cast<int>(i);
    std::vector<std::pair<std::pair<int, int>, int>> by_places;
    for (std::size_t i = 0; i < links_.size(); ++i) {
      const auto [a, b] = links_[i].joints;
      by_places.push_back({std::minmax({place[a], place[b]}), static_cast<int>(i)});
    }
    std::sort(by_places.begin(), by_places.end());
    for (;;) {
      std::vector<ParityLink> clear;
      for (const auto& [places, link] : by_places)
        if (is_clear(link))
          clear.push_back({{places.first, places.second}, cosines_[link] < 0 ? 1 : 0});
      std::vector<int> loop = shortest_odd_cycle(static_cast<int>(pairs_.size()), clear);
      if (loop.empty()) return;
      for (int& joint : loop) joint = by_rank_[joint];
      const std::vector<int> links = links_around(loop);
      if (!is_cell(loop, links)) refuse_one_sided(loop);
      is_ignored_[*std::min_element(links.begin(), links.end(), [&](int a, int b) {
        return std::abs(cosines_[a]) < std::abs(cosines_[b]);
      })] = 1;
    }
  }

  /// From each joint of a loop to the next.
  [[nodiscard]] std::vector<int> links_around(const std::vector<int>& loop) const {
    std::vector<int> links;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const int next = loop[(i + 1) % loop.size()];
      const auto& neighbours = neighbours_[loop[i]];
      links.push_back(std::find_if(neighbours.begin(), neighbours.end(), [&](const Neighbour& n) {
                        return n.joint == next;
                      })->link);
    }
    return links;
  }

  /// Does a loop go from one rod to the other at each of a few joints, or at four as around a
  /// rectangle of cells? Loops along a band turn less, or more often.
  [[nodiscard]] bool is_cell(const std::vector<int>& loop, const std::vector<int>& links) const {
    std::size_t turns = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const auto rod_at = [&](int link) {
        return links_[link].rods[links_[link].joints[0] == loop[i] ? 0 : 1];
      };
      if (rod_at(links[i]) != rod_at(links[(i + loop.size() - 1) % loop.size()])) ++turns;
    }
    return turns == 4 || (turns == loop.size() && turns <= kMaxCorners);
  }

  [[noreturn]] void refuse_one_sided(std::vector<int> loop) const {
    for (int& joint : loop) joint = places_[joint].vertex;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("vertices[{}]", loop.front()),
                fmt::format("the surface through the joints has one side only: around the loop of "
                            "{} the normal comes back reversed. Cut the loop, or close it with a "
                            "whole turn in place of a half one",
                            loop_text(loop)));
  }

  /// Along a rod the opening angle stays on the same side, hence the rod keeps its letter.
  void set_letters() {
    ParityForest letters(pairs_.size());
    for (const JointLink& link : links_) {
      const bool is_consistent =
          letters.join(link.joints[0], link.joints[1], link.rods[0] ^ link.rods[1]);
      LIMBER_DEMAND(is_consistent);
    }
    std::vector<int> reference(pairs_.size(), -1);
    for (const bool open : {true, false}) {
      for (std::size_t j = 0; j < pairs_.size(); ++j) {
        const auto [root, parity] = letters.root(static_cast<int>(j));
        if (reference[root] < 0 && is_open(static_cast<int>(j)) == open) reference[root] = parity;
        result_.rod_a[j] = parity ^ std::max(reference[root], 0);
      }
    }
  }

  /// Joints of each connected part, by rank.
  [[nodiscard]] std::vector<std::vector<int>> components() const {
    DisjointSets parts(pairs_.size());
    for (const JointLink& link : links_) parts.join(link.joints[0], link.joints[1]);
    std::vector<int> numbers(pairs_.size(), -1);
    std::vector<std::vector<int>> all;
    for (const int joint : by_rank_) {
      int& number = numbers[parts.lowest(joint)];
      if (number < 0) {
        number = static_cast<int>(all.size());
        all.emplace_back();
      }
      all[number].push_back(joint);
    }
    return all;
  }

  void turn_over(const std::vector<int>& joints) {
    for (const int joint : joints) {
      result_.normals[joint] = -result_.normals[joint];
      // The same pair of sectors, seen from behind.
      result_.rod_a[joint] = 1 - result_.rod_a[joint];
    }
  }

  /// Of the two sides of a component's surface, the one whose normals point up on the whole; where
  /// they point nowhere, the outer one.
  void settle_normals(const std::vector<int>& joints) {
    const auto count = static_cast<double>(joints.size());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
    for (const int joint : joints) {
      sum += result_.normals[joint];
      middle += places_[joint].position / count;
    }
    for (const int axis : {2, 1, 0}) {
      if (std::abs(sum[axis]) < 1e-3 * count) continue;
      if (sum[axis] < 0) turn_over(joints);
      return;
    }
    double outward = 0;
    for (const int joint : joints)
      outward += (places_[joint].position - middle).dot(result_.normals[joint]);
    if (outward < 0) turn_over(joints);
  }

  double angle_in_half_turn(int joint, int& sign_b) const {
    const RodPair& pair = pairs_[joint];
    const Eigen::Vector3d& a = pair.tangents[result_.rod_a[joint]];
    const Eigen::Vector3d& b = pair.tangents[1 - result_.rod_a[joint]];
    const double sine = a.cross(b).dot(result_.normals[joint]);
    sign_b = sine < 0 ? -1 : 1;
    return std::atan2(std::abs(sine), sign_b * a.dot(b));
  }

  void settle_angles(const std::vector<int>& joints) {
    double obtuse = 0;
    for (const int joint : joints) {
      result_.angles[joint] = angle_in_half_turn(joint, result_.signs_b[joint]);
      obtuse += result_.angles[joint] > std::numbers::pi / 2 ? 1 : 0;
    }
    if (2 * obtuse > static_cast<double>(joints.size())) {
      for (const int joint : joints) {
        result_.rod_a[joint] = 1 - result_.rod_a[joint];
        result_.angles[joint] = angle_in_half_turn(joint, result_.signs_b[joint]);
      }
    }
    follow_angles(joints);
  }

  /// A scissor that is closed may be a little past closed: beyond 0 or pi where that is nearer to
  /// its neighbours. Followed from the joint that is least in doubt.
  void follow_angles(const std::vector<int>& joints) {
    const auto uncertainty = [&](int joint) {
      return std::abs(result_.angles[joint] - std::numbers::pi / 2);
    };
    std::vector<int> order = {*std::min_element(joints.begin(), joints.end(), [&](int a, int b) {
      return uncertainty(a) < uncertainty(b);
    })};
    std::vector<bool> followed(pairs_.size(), false);
    followed[order[0]] = true;
    for (std::size_t next = 0; next < order.size(); ++next) {
      const double reference = result_.angles[order[next]];
      for (const Neighbour& neighbour : neighbours_[order[next]]) {
        if (followed[neighbour.joint]) continue;
        followed[neighbour.joint] = true;
        order.push_back(neighbour.joint);
        double& angle = result_.angles[neighbour.joint];
        double beyond = angle;
        if (angle > std::numbers::pi - kOvershoot) beyond = angle - std::numbers::pi;
        if (angle < kOvershoot) beyond = angle + std::numbers::pi;
        if (std::abs(beyond - reference) >= std::abs(angle - reference)) continue;
        angle = beyond;
        result_.signs_b[neighbour.joint] *= -1;
      }
    }
  }

  const std::vector<RodPair>& pairs_;
  const std::vector<JointLink>& links_;
  const std::vector<JointPlace>& places_;
  std::vector<std::vector<Neighbour>> neighbours_;
  std::vector<int> by_rank_;
  std::vector<double> cosines_;   // of links: see kClear
  std::vector<char> is_ignored_;  // what a link says of the sides
  JointOrientations result_;
};

}  // namespace

JointOrientations orient_joints(const std::vector<RodPair>& pairs,
                                const std::vector<JointLink>& links,
                                const std::vector<JointPlace>& places) {
  return Orientation(pairs, links, places).run();
}

}  // namespace limber::rods::detail
