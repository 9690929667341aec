#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// A linkage cut into edges of half the length, with the same joints, rods and rest lengths: the
/// next finer discretisation of another model.
///
/// Places along a segment are counted in edges of the given model from its first vertex. Vertex i
/// is at i, a joint at the start at 1/2, one at the finish at n - 1/2. A segment of n edges gets 2
/// n - 1 between two joints, 2 n otherwise, so that terminal edges stay centred at their joints and
/// have half the length.
class HalvedLinkage {
 public:
  /// @param model  given; its sizes are taken over
  explicit HalvedLinkage(const LinkageModel& model);

  /// Half edges.
  [[nodiscard]] const LinkageModel& model() const { return halved_; }

  /// Takes over rest lengths and sections. @param given  of the same graph and edges
  void set_sizes(const LinkageModel& given);

  /// A shape of the given model with half edges: vertices by cubic interpolation along the rods,
  /// frames between those of the given edges, turned by their share of the twist.
  [[nodiscard]] LinkageState prolonged(const LinkageModel& given, const LinkageState& state) const;

  /// From a place along a segment of the given model to that of the same material along the halved
  /// one.
  [[nodiscard]] double halved_place(int segment, double place) const;

  /// The largest distance between points of the same material in two shapes: joints, free ends and
  /// the given vertices between them.
  struct Distance {
    double largest = 0;  // [length]
    int segment = 0;     // where it is, and at which place
    double place = 0;
  };
  [[nodiscard]] Distance distance(const LinkageModel& given, const LinkageState& given_state,
                                  const LinkageState& halved_state) const;

 private:
  LinkageModel halved_;
  std::vector<std::vector<double>> places_;  // of the halved vertices of each segment
  /// At rest from a segment's first given vertex, of the given and of the halved vertices [length].
  std::vector<Eigen::VectorXd> given_lengths_, halved_lengths_;
};

/// How many edges halving makes of those of each segment.
[[nodiscard]] std::vector<int> halved_edges(const LinkageGraph& graph,
                                            const ReducedVariables& variables);

}  // namespace limber::rods
