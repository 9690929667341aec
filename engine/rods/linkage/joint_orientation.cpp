#include "engine/rods/linkage/joint_orientation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"

namespace limber::rods::detail {
namespace {

// Below this sine of the angle between its rods a joint's own normal is taken from its neighbours.
constexpr double kLeastSine = 1e-5;
// How far an opening angle may lie beyond 0 or pi where the neighbours are on that side [rad].
constexpr double kOvershoot = 0.3;
// Cosine between a normal and its neighbour's, carried along the segment, below which the surface
// has turned over.
constexpr double kTurnedOver = -0.5;

struct Neighbour {
  int joint;
  int own_rod;
  int other_rod;
};

class Orientation {
 public:
  Orientation(const std::vector<RodPair>& pairs, const std::vector<JointLink>& links,
              const std::vector<int>& vertices)
      : pairs_(pairs), links_(links), vertices_(vertices), neighbours_(pairs.size()) {
    for (const JointLink& link : links) {
      neighbours_[link.joints[0]].push_back({link.joints[1], link.rods[0], link.rods[1]});
      neighbours_[link.joints[1]].push_back({link.joints[0], link.rods[1], link.rods[0]});
    }
  }

  JointOrientations run() {
    const std::size_t count = pairs_.size();
    result_ = {std::vector<Eigen::Vector3d>(count, Eigen::Vector3d::Zero()),
               std::vector<int>(count, -1), std::vector<double>(count, 0),
               std::vector<int>(count, 1)};
    visited_.assign(count, false);
    // Joints whose own normal is good start first, so that closed ones learn from them.
    for (const bool open : {true, false}) {
      for (std::size_t joint = 0; joint < count; ++joint) {
        if (!visited_[joint] && is_open(static_cast<int>(joint)) == open) {
          orient_component(static_cast<int>(joint));
        }
      }
    }
    check_links();
    return std::move(result_);
  }

 private:
  Eigen::Vector3d own_normal(int joint) const {
    return pairs_[joint].tangents[0].cross(pairs_[joint].tangents[1]);
  }
  bool is_open(int joint) const { return own_normal(joint).norm() > kLeastSine; }

  /// The normal of `from` turned with the rod's tangent on its way to the neighbour.
  Eigen::Vector3d carried_normal(int from, const Neighbour& to) const {
    const Eigen::Vector3d& before = pairs_[from].tangents[to.own_rod];
    Eigen::Vector3d after = pairs_[to.joint].tangents[to.other_rod];
    if (before.dot(after) < 0) after = -after;  // tangents of rods have no direction yet
    return Eigen::Quaterniond::FromTwoVectors(before, after) * result_.normals[from];
  }

  void set_normal(int joint, const Eigen::Vector3d& hint) {
    Eigen::Vector3d normal = own_normal(joint);
    if (!is_open(joint)) {
      const Eigen::Vector3d& t = pairs_[joint].tangents[0];
      normal = hint - t * t.dot(hint);
      if (normal.norm() < 1e-3) normal = t.unitOrthogonal();
    }
    if (normal.dot(hint) < 0) normal = -normal;
    result_.normals[joint] = normal.normalized();
  }

  void orient_component(int first) {
    std::vector<int> order = {first};
    visited_[first] = true;
    set_normal(first, own_normal(first));
    result_.rod_a[first] = 0;
    for (std::size_t next = 0; next < order.size(); ++next) {
      const int joint = order[next];
      for (const Neighbour& neighbour : neighbours_[joint]) {
        // Along a rod the opening angle stays on the same side, hence the rod keeps its letter.
        const bool is_a = neighbour.own_rod == result_.rod_a[joint];
        const int rod_a = is_a ? neighbour.other_rod : 1 - neighbour.other_rod;
        if (!visited_[neighbour.joint]) {
          visited_[neighbour.joint] = true;
          order.push_back(neighbour.joint);
          set_normal(neighbour.joint, carried_normal(joint, neighbour));
          result_.rod_a[neighbour.joint] = rod_a;
        } else if (result_.rod_a[neighbour.joint] != rod_a) {
          refuse(neighbour.joint,
                 "no choice of opening angles is consistent along the rods: around a loop of rods "
                 "that ends at the joint at vertex {} the angle turns into its supplement");
        }
      }
    }
    settle_normals(order);
    settle_angles(order);
  }

  [[noreturn]] void refuse(int joint, const char* text) const {
    const int vertex = vertices_[joint];
    throw Error(ErrorCode::kInvalidArgument, fmt::format("vertices[{}]", vertex),
                fmt::format(fmt::runtime(text), vertex));
  }

  /// Of the two sides of a component's surface, the one whose normals point up on the whole.
  void settle_normals(const std::vector<int>& joints) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int joint : joints) sum += result_.normals[joint];
    for (const int axis : {2, 1, 0}) {
      if (std::abs(sum[axis]) < 1e-3 * static_cast<double>(joints.size())) continue;
      if (sum[axis] > 0) return;
      for (const int joint : joints) {
        result_.normals[joint] = -result_.normals[joint];
        result_.rod_a[joint] =
            1 - result_.rod_a[joint];  // the same pair of sectors, seen from behind
      }
      return;
    }
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
    const auto doubt = [&](int joint) {
      return std::abs(result_.angles[joint] - std::numbers::pi / 2);
    };
    std::vector<int> order = {*std::min_element(joints.begin(), joints.end(),
                                                [&](int a, int b) { return doubt(a) < doubt(b); })};
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

  void check_links() const {
    for (const JointLink& link : links_) {
      const Eigen::Vector3d carried =
          carried_normal(link.joints[0], {link.joints[1], link.rods[0], link.rods[1]});
      if (carried.dot(result_.normals[link.joints[1]]) < kTurnedOver) {
        refuse(link.joints[1],
               "the surface through the joints has one side only: around a loop that ends at the "
               "joint at vertex {} the normal comes back reversed");
      }
    }
  }

  const std::vector<RodPair>& pairs_;
  const std::vector<JointLink>& links_;
  const std::vector<int>& vertices_;
  std::vector<std::vector<Neighbour>> neighbours_;
  std::vector<bool> visited_;
  JointOrientations result_;
};

}  // namespace

JointOrientations orient_joints(const std::vector<RodPair>& pairs,
                                const std::vector<JointLink>& links,
                                const std::vector<int>& vertices) {
  return Orientation(pairs, links, vertices).run();
}

}  // namespace limber::rods::detail
