#include "engine/rods/linkage/linkage_model.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/rods/linkage/chains.h"

namespace limber::rods {
namespace {

void demand_positive_sizes(const char* field, const char* what,
                           const Eigen::Ref<const Eigen::VectorXd>& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (values[i] > 0 && std::isfinite(values[i])) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}[{}]", field, i),
                fmt::format("{} {} is {}; it must be positive", what, i, values[i]));
  }
}

}  // namespace

void RodStiffness::validate() const {
  const auto check = [](const char* name, double value) {
    if (value > 0 && std::isfinite(value)) return;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("stiffness.{}", name),
                fmt::format("stiffness.{} must be positive and finite, got {}", name, value));
  };
  check("stretching", stretching);
  check("bending_1", bending_1);
  check("bending_2", bending_2);
  check("torsion", torsion);
}

LinkageModel::LinkageModel(LinkageGraph graph, int edges_per_segment, const RodStiffness& stiffness,
                           BendingForm form)
    : LinkageModel(graph, std::vector<int>(graph.segments.size(), edges_per_segment), stiffness,
                   form) {}

LinkageModel::LinkageModel(LinkageGraph graph, std::vector<int> edges_per_segment,
                           const RodStiffness& stiffness, BendingForm form)
    : graph_(std::move(graph)),
      variables_(graph_, std::move(edges_per_segment)),
      chains_(chains_of(graph_, variables_)),
      lengths_(drawn_lengths(graph_)),
      rest_map_(graph_, variables_, lengths_),
      edges_(graph_, variables_),
      rest_(rest_map_.apply(lengths_)),
      sections_(Eigen::VectorXd::Ones(lengths_.size())),
      stiffness_(stiffness),
      form_(form) {
  stiffness_.validate();
  first_slot_.push_back(0);
  for (const ChainBatch& batch : chains_->batches())
    first_slot_.push_back(first_slot_.back() + static_cast<std::size_t>(batch.edges) + 1);
  fill_parameters();
}

void LinkageModel::set_segment_lengths(const Eigen::Ref<const Eigen::VectorXd>& lengths) {
  rest_ = rest_map_.apply(lengths);
  lengths_ = lengths;
  fill_parameters();
}

void LinkageModel::set_edge_lengths(const Eigen::Ref<const Eigen::VectorXd>& edges) {
  LIMBER_DEMAND(edges.size() == edges_.size());
  demand_positive_sizes("edges", "the rest length of edge", edges);
  rest_ = edges_.distributed(edges);
  lengths_ = edges_.segment_lengths(edges);
  fill_parameters();
}

void LinkageModel::set_section_scales(const Eigen::Ref<const Eigen::VectorXd>& scales) {
  LIMBER_DEMAND(scales.size() == sections_.size());
  demand_positive_sizes("sections", "the section's scale of segment", scales);
  sections_ = scales;
  fill_parameters();
}

void LinkageModel::fill_parameters() {
  parameters_.assign(slots() * kFields, {{1, 1, 1, 1}});  // empty lanes: any rod will do
  for (std::size_t b = 0; b < chains_->batches().size(); ++b) {
    const ChainBatch& batch = chains_->batches()[b];
    for (int lane = 0; lane < kChainLanes; ++lane) {
      const int segment = batch.chains[lane];
      if (segment < 0) continue;
      const double area = sections_[segment] * sections_[segment];
      for (int edge = 0; edge < batch.edges; ++edge) {
        const bool terminal =
            (batch.has_start && edge == 0) || (batch.has_finish && edge == batch.edges - 1);
        detail::LaneCell* const cells = &parameters_[(first_slot_[b] + edge) * kFields];
        cells[kRestLength].values[lane] = rest_.edge(graph_, variables_, segment, edge);
        cells[kStretching].values[lane] =
            stiffness_.stretching * (terminal ? kTerminalDensity : 1.0) * area;
        cells[kBending].values[lane] = area * area;
      }
    }
  }
}

}  // namespace limber::rods
