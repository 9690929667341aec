#pragma once

#include <memory>
#include <vector>

#include "engine/rods/linkage/edge_numbers.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/linkage/rest_length_map.h"
#include "engine/rods/linkage/rest_lengths.h"
#include "engine/rods/rod/length_weights.h"
#include "engine/rods/solver/chain_batches.h"
#include "engine/rods/solver/lanes.h"

namespace limber::rods {

/// Stiffnesses of every rod of a linkage with sections that are not scaled; joints have none.
struct RodStiffness {
  double stretching = 1;  // E A [force]
  double bending_1 = 1;   // lambda_1 [force length^2]: curvature about the joint normals
  double bending_2 = 1;   // lambda_2: curvature about the other axis of the section
  double torsion = 1;     // G J [force length^2]

  /// @throws Error{kInvalidArgument} naming the stiffness: it must be positive and finite
  void validate() const;
};

/// A linkage without its shape: its connections and its stiffness. Rods are straight and without
/// twist at rest.
class LinkageModel {
 public:
  /// @throws Error as RodStiffness::validate, ReducedVariables and distribute_rest_lengths
  LinkageModel(LinkageGraph graph, std::vector<int> edges_per_segment,
               const RodStiffness& stiffness, BendingForm form = kDefaultBending);
  /// The same number of edges in every segment.
  LinkageModel(LinkageGraph graph, int edges_per_segment, const RodStiffness& stiffness,
               BendingForm form = kDefaultBending);

  [[nodiscard]] const LinkageGraph& graph() const { return graph_; }
  [[nodiscard]] const ReducedVariables& variables() const { return variables_; }
  [[nodiscard]] const std::shared_ptr<const ChainBatches>& chains() const { return chains_; }
  [[nodiscard]] const RestLengths& rest_lengths() const { return rest_; }
  [[nodiscard]] const RodStiffness& stiffness() const { return stiffness_; }
  [[nodiscard]] BendingForm form() const { return form_; }

  /// Rest lengths of segments, from graph vertex to graph vertex; at first as drawn.
  [[nodiscard]] const Eigen::VectorXd& segment_lengths() const { return lengths_; }
  /// How they become those of edges.
  [[nodiscard]] const RestLengthMap& rest_length_map() const { return rest_map_; }
  /// New rest lengths of segments.
  /// @throws Error as RestLengthMap::apply
  void set_segment_lengths(const Eigen::Ref<const Eigen::VectorXd>& lengths);

  [[nodiscard]] const EdgeNumbers& edge_numbers() const { return edges_; }
  /// Rest lengths of edges by their numbers.
  [[nodiscard]] Eigen::VectorXd edge_lengths() const { return edges_.listed(rest_); }
  /// New rest lengths of edges; those of segments become their sums.
  /// @throws Error{kInvalidArgument} with field edges[e] for one that is not positive and finite
  void set_edge_lengths(const Eigen::Ref<const Eigen::VectorXd>& edges);

  /// Scale s of each segment's section, which is s times as large in both directions, so that it
  /// has E A s^2, lambda s^4 and G J s^4. Each segment scales its own half of a terminal edge's
  /// energy.
  [[nodiscard]] const Eigen::VectorXd& section_scales() const { return sections_; }
  /// @throws Error{kInvalidArgument} with field sections[s] for one that is not positive and finite
  void set_section_scales(const Eigen::Ref<const Eigen::VectorXd>& scales);

  /// Slots of a batch in arrays by slot: one for each vertex and the edge after it.
  [[nodiscard]] std::size_t first_slot(int batch) const { return first_slot_[batch]; }
  [[nodiscard]] std::size_t slots() const { return first_slot_.back(); }

  /// By slot, for kernels: rest length of the edge, its stretching stiffness with this segment's
  /// share of it, and lambda and G J of RodStiffness at the vertex after it.
  enum Field { kRestLength, kStretching, kBending, kFields };
  [[nodiscard]] const double* slot_parameters(int batch) const {
    return parameters_[first_slot_[batch] * kFields].values;
  }

 private:
  void fill_parameters();

  LinkageGraph graph_;
  ReducedVariables variables_;
  std::shared_ptr<const ChainBatches> chains_;
  Eigen::VectorXd lengths_;
  RestLengthMap rest_map_;
  EdgeNumbers edges_;
  RestLengths rest_;
  Eigen::VectorXd sections_;
  RodStiffness stiffness_;
  BendingForm form_;
  std::vector<std::size_t> first_slot_;
  std::vector<detail::LaneCell> parameters_;
};

}  // namespace limber::rods
