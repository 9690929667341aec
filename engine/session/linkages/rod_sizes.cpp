#include "engine/session/linkages/rod_sizes.h"

#include <algorithm>

namespace limber::session {
namespace {

bool same(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() && a == b;
}

bool by_edges(const RodSizes& from, const RodSizes& to) {
  return from.edges.size() > 0 || to.edges.size() > 0;
}

/// Lengths of every edge, also if only those of segments are given.
Eigen::VectorXd edges_of(const rods::LinkageModel& model, const RodSizes& sizes) {
  if (sizes.edges.size() > 0) return sizes.edges;
  return model.edge_numbers().listed(model.rest_length_map().apply(sizes.segments));
}

Eigen::VectorXd sections_of(const RodSizes& sizes) {
  if (sizes.sections.size() > 0) return sizes.sections;
  return Eigen::VectorXd::Ones(sizes.segments.size());
}

}  // namespace

bool RodSizes::operator==(const RodSizes& other) const {
  return same(segments, other.segments) && same(edges, other.edges) &&
         same(sections_of(*this), sections_of(other));
}

RodSizes sizes_under(const scene::LinkageConditions& conditions, const Eigen::VectorXd& drawn,
                     const rods::EdgeNumbers& numbers) {
  RodSizes sizes{drawn, conditions.edge_lengths, conditions.section_scales};
  if (conditions.segment_lengths.size() > 0) sizes.segments = conditions.segment_lengths;
  if (sizes.edges.size() > 0) sizes.segments = numbers.segment_lengths(sizes.edges);
  return sizes;
}

void set_sizes(rods::LinkageModel& model, const RodSizes& sizes) {
  if (sizes.edges.size() > 0) {
    model.set_edge_lengths(sizes.edges);
  } else {
    model.set_segment_lengths(sizes.segments);
  }
  const Eigen::VectorXd sections = sections_of(sizes);
  if (sections != model.section_scales()) model.set_section_scales(sections);
}

RodSizes sizes_between(const rods::LinkageModel& model, const RodSizes& from, const RodSizes& to,
                       double share) {
  const auto between = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return Eigen::VectorXd(a + share * (b - a));
  };
  RodSizes sizes{
      between(from.segments, to.segments), {}, between(sections_of(from), sections_of(to))};
  if (by_edges(from, to)) sizes.edges = between(edges_of(model, from), edges_of(model, to));
  return sizes;
}

double largest_change(const rods::LinkageModel& model, const RodSizes& from, const RodSizes& to) {
  const auto change = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return (b - a).cwiseQuotient(a).cwiseAbs().maxCoeff();
  };
  const double lengths = by_edges(from, to) ? change(edges_of(model, from), edges_of(model, to))
                                            : change(from.segments, to.segments);
  return std::max(lengths, change(sections_of(from), sections_of(to)));
}

}  // namespace limber::session
