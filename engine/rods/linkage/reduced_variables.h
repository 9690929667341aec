#pragma once

#include <array>
#include <vector>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// Unknowns of a joint, in order: position (3), rotation vector (3), opening angle, length of rod
/// A's edge, length of rod B's edge.
inline constexpr int kJointUnknowns = 9;
enum JointUnknown : int {
  kJointPosition = 0,
  kJointRotation = 3,
  kJointAngle = 6,
  kJointLengthA = 7,
  kJointLengthB = 8,
};

/// Positions of the unknowns of each vertex and edge of each segment (rod linkages, sec. 1.3).
///
/// A segment of n edges has vertices x_0 .. x_n and edge angles theta_0 .. theta_(n-1). A joint at
/// its start moves x_0, theta_0 and x_1 (its terminal edge), a joint at its finish x_(n-1),
/// theta_(n-1) and x_n. The rest is the segment's free chain, interleaved so that energies of one
/// interior vertex touch 11 consecutive numbers:
///
///   theta_1, x_2, theta_2, .., x_(n-2), theta_(n-2)     between two joints
///   theta_1, x_2, .., theta_(n-1), x_n                  from a joint to a free end
///   x_0, theta_0, x_1, .., x_(n-2), theta_(n-2)         from a free end to a joint
///   x_0, theta_0, .., theta_(n-1), x_n                  without joints
///
/// The reduced vector holds the chains of all segments, then nine unknowns for each joint.
class ReducedVariables {
 public:
  /// @param edges_per_segment  >= 3 between two joints, >= 2 with one free end, >= 1 without joints
  /// @throws Error{kInvalidArgument} with field edges_per_segment[s]; {kLimitExceeded} with that
  /// field for more unknowns than an int counts; a size that does not fit
  ReducedVariables(const LinkageGraph& graph, std::vector<int> edges_per_segment);
  /// The same number of edges in every segment.
  ReducedVariables(const LinkageGraph& graph, int edges_per_segment);

  [[nodiscard]] int size() const { return joints_begin_ + kJointUnknowns * joints_; }
  [[nodiscard]] int segments() const { return static_cast<int>(edges_.size()); }
  [[nodiscard]] int joints() const { return joints_; }

  [[nodiscard]] int edges(int segment) const { return edges_[segment]; }
  [[nodiscard]] int chain_begin(int segment) const { return chains_[segment]; }
  [[nodiscard]] int chain_size(int segment) const {
    return chains_[segment + 1] - chains_[segment];
  }
  [[nodiscard]] int joint_begin(int joint) const { return joints_begin_ + kJointUnknowns * joint; }

  /// Index of the x coordinate of vertex i of a segment (y and z follow); -1: a joint moves it.
  [[nodiscard]] int position(int segment, int vertex) const {
    return local(segment, 4 * vertex, 3);
  }
  /// Index of the angle of edge i of a segment; -1: a joint gives it.
  [[nodiscard]] int angle(int segment, int edge) const { return local(segment, 4 * edge + 3, 1); }

 private:
  /// Chains are x_0, theta_0, x_1, theta_1, ... without seven numbers at each joint.
  [[nodiscard]] int local(int segment, int index, int width) const {
    const int place = index - skipped_[segment];
    if (place < 0 || place + width > chain_size(segment)) return -1;
    return chains_[segment] + place;
  }

  std::vector<int> edges_;
  std::vector<int> chains_;   // segments + 1
  std::vector<int> skipped_;  // 7 with a joint at the start, else 0
  int joints_begin_ = 0;
  int joints_ = 0;
};

}  // namespace limber::rods
