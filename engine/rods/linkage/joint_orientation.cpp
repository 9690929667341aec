#include "engine/rods/linkage/joint_orientation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "engine/base/disjoint_sets.h"
#include "engine/base/error.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/rods/linkage/cell_sides.h"
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
// The same below which cells around a segment may say that it is the other one.
constexpr double kMostCorrected = 0.75;
// Sine between rods above which their own plane counts, and not a given normal's.
constexpr double kClearSine = 0.05;
constexpr double kLeastShare = 0.1;  // of a given normal across its rods

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
    if (has_normals()) {
      take_normals();
    } else {
      find_axes();
      set_sides();
    }
    set_letters();
    for (const std::vector<int>& joints : components()) {
      if (!has_normals()) settle_normals(joints);
      settle_angles(joints);
    }
    return std::move(result_);
  }

 private:
  Eigen::Vector3d own_normal(int joint) const {
    return pairs_[joint].tangents[0].cross(pairs_[joint].tangents[1]);
  }
  bool is_open(int joint) const { return own_normal(joint).norm() > kLeastSine; }
  [[nodiscard]] bool has_normals() const {
    return !places_.empty() && places_.front().normal.squaredNorm() > 0;
  }

  /// Joints have the normals of their rods, on the given side, as far as these cross clearly.
  void take_normals() {
    for (std::size_t j = 0; j < pairs_.size(); ++j) {
      const auto& [a, b] = pairs_[j].tangents;
      const Eigen::Vector3d& given = places_[j].normal;
      const Eigen::Vector3d along = a.dot(b) < 0 ? Eigen::Vector3d(a - b) : Eigen::Vector3d(a + b);
      Eigen::Vector3d normal = given - given.dot(along) / along.squaredNorm() * along;
      const Eigen::Vector3d own = own_normal(static_cast<int>(j));
      if (own.norm() > kClearSine) normal = own.dot(given) / own.squaredNorm() * own;
      if (normal.norm() < kLeastShare) {
        throw Error(ErrorCode::kInvalidArgument, fmt::format("normals[{}]", places_[j].vertex),
                    fmt::format("normal {} (from 0) lies in the plane of the rods that meet at its "
                                "vertex: it must point out of it",
                                places_[j].vertex));
      }
      result_.normals[j] = normal.normalized();
    }
    for (const JointLink& link : links_) {
      const auto [a, b] = link.joints;
      if (carried_normal(link, 0).dot(result_.normals[b]) >= -kClear) continue;
      throw Error(ErrorCode::kInvalidArgument, fmt::format("normals[{}]", places_[b].vertex),
                  fmt::format("normals {} and {} (from 0) point to different sides of edge {}, "
                              "which connects their vertices",
                              places_[a].vertex, places_[b].vertex, link.segment));
    }
  }

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
    ParityForest sides(pairs_.size());
    if (!join_sides(sides)) {
      correct_sides(pairs_, links_, result_.normals, kMostCorrected, cosines_);
      sides = ParityForest(pairs_.size());
      if (!join_sides(sides)) refuse_one_sided();
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
      return std::pair(-std::abs(cosines_[i]), std::minmax({places_[a].rank, places_[b].rank}));
    };
    std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
    bool agree = true;
    for (const int i : order) {
      const auto [a, b] = links_[i].joints;
      if (!sides.join(a, b, cosines_[i] < 0 ? 1 : 0) && is_clear(i)) agree = false;
    }
    return agree;
  }

  [[nodiscard]] bool is_clear(int link) const { return std::abs(cosines_[link]) > kClear; }

  [[noreturn]] void refuse_one_sided() const {
    std::vector<int> place(pairs_.size());  // in the order by rank
    for (std::size_t i = 0; i < by_rank_.size(); ++i) place[by_rank_[i]] = static_cast<int>(i);
    std::vector<std::pair<std::pair<int, int>, int>> clear;
    for (std::size_t i = 0; i < links_.size(); ++i) {
      const auto [a, b] = links_[i].joints;
      if (is_clear(static_cast<int>(i)))
        clear.push_back({std::minmax({place[a], place[b]}), cosines_[i] < 0 ? 1 : 0});
    }
    std::sort(clear.begin(), clear.end());
    std::vector<ParityLink> parities;
    for (const auto& [ends, parity] : clear)
      parities.push_back({{ends.first, ends.second}, parity});
    std::vector<int> loop = shortest_odd_cycle(static_cast<int>(pairs_.size()), parities);
    for (int& joint : loop) joint = places_[by_rank_[joint]].vertex;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("vertices[{}]", loop.front()),
                fmt::format("the surface through the joints has one side only: around the loop of "
                            "{} the normal comes back reversed. Cut the loop, or close it with a "
                            "whole turn in place of a half one; or give normals, if the rods bend "
                            "sharply there",
                            loop_text(loop)));
  }

  /// Along a rod the opening angle stays on the same side, hence the rod keeps its letter, as far
  /// as that is possible.
  void set_letters() {
    ParityForest letters(pairs_.size());
    has_contradiction_.assign(pairs_.size(), 0);
    for (const JointLink& link : links_) {
      const auto [a, b] = link.joints;
      if (letters.join(a, b, link.rods[0] ^ link.rods[1])) continue;
      has_contradiction_[a] = 1;
      result_.is_mixed = true;
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

  /// Selects the side of a component's surface whose normals point up on the whole; if they point
  /// nowhere, the outer one.
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

  [[nodiscard]] bool is_mixed(const std::vector<int>& joints) const {
    return std::any_of(joints.begin(), joints.end(),
                       [&](int joint) { return has_contradiction_[joint] != 0; });
  }

  /// For rods whose angles cannot be on one side along each: the acute angle of every joint.
  void settle_mixed_angles(const std::vector<int>& joints) {
    for (const int joint : joints) {
      result_.rod_a[joint] = 0;
      double angle = angle_in_half_turn(joint, result_.signs_b[joint]);
      if (angle > std::numbers::pi / 2) {
        result_.rod_a[joint] = 1;
        angle = angle_in_half_turn(joint, result_.signs_b[joint]);
      }
      result_.angles[joint] = angle;
    }
  }

  void settle_angles(const std::vector<int>& joints) {
    if (is_mixed(joints)) return settle_mixed_angles(joints);
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
  std::vector<double> cosines_;          // of links: see kClear
  std::vector<char> has_contradiction_;  // of joints: a link whose letters do not fit others'
  JointOrientations result_;
};

}  // namespace

JointOrientations orient_joints(const std::vector<RodPair>& pairs,
                                const std::vector<JointLink>& links,
                                const std::vector<JointPlace>& places) {
  return Orientation(pairs, links, places).run();
}

}  // namespace limber::rods::detail
