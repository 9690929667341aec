#pragma once

#include <array>
#include <vector>

#include "engine/rods/linkage/rest_lengths.h"

namespace limber::rods {

/// Maps rest lengths of segments to those of edges. The map is linear: which of its two segments
/// gives a terminal edge its length is chosen once, by the lengths at construction (the shorter
/// uniform one). Rest lengths can therefore be varied and differentiated without kinks.
class RestLengthMap {
 public:
  /// @param lengths  of segments, as for distribute_rest_lengths, which says the rule
  /// @throws Error{kInvalidArgument} with field lengths[s] for one that is not positive and finite
  RestLengthMap(const LinkageGraph& graph, const ReducedVariables& variables,
                const Eigen::Ref<const Eigen::VectorXd>& lengths);

  [[nodiscard]] int segments() const { return static_cast<int>(segments_.size()); }

  /// @throws Error{kInvalidArgument} with field lengths[s] where a segment's length, or what its
  /// terminal edges leave of it, is not positive and finite
  [[nodiscard]] RestLengths apply(const Eigen::Ref<const Eigen::VectorXd>& lengths) const;
  /// Change of the edges for a change of lengths, which may be any numbers.
  [[nodiscard]] RestLengths apply_to_change(const Eigen::Ref<const Eigen::VectorXd>& change) const;
  /// From derivatives by the rest lengths of edges (terminal: of each joint's rods; free_edge: the
  /// sum over a segment's free edges) to those by the lengths of segments.
  [[nodiscard]] Eigen::VectorXd transposed(const RestLengths& derivatives) const;

 private:
  /// A terminal edge of a segment.
  struct Terminal {
    int joint = -1;  // -1: none
    RodOfJoint rod = kRodA;
  };
  struct Shares {
    std::array<Terminal, 2> ends;
    double uniform;  // edges in its length
    int free_edges;
  };

  std::vector<Shares> segments_;
  std::vector<std::array<int, 2>> givers_;  // by joint and rod: the segment; -1: there is no rod
};

}  // namespace limber::rods
