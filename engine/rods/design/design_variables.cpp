#include "engine/rods/design/design_variables.h"

#include <fmt/format.h>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

void demand_count(const char* field, const char* what, Eigen::Index given, Eigen::Index needed) {
  if (given == needed) return;
  throw Error(ErrorCode::kInvalidArgument, field,
              fmt::format("must be one for each of {} {}, are {}", needed, what, given));
}

}  // namespace

void DesignVariables::validate() const {
  if (lengths != LengthVariables::kKept || sections != SectionVariables::kKept) return;
  throw Error(ErrorCode::kInvalidArgument, "lengths",
              "a design has to vary rest lengths, sections or both");
}

void set_sizes(LinkageModel& model, const DesignPoint& point) {
  const int segments = model.variables().segments();
  if (point.edges.size() > 0) {
    demand_count("edges", "edges", point.edges.size(), model.edge_numbers().size());
    model.set_edge_lengths(point.edges);
  } else {
    demand_count("lengths", "segments", point.lengths.size(), segments);
    model.set_segment_lengths(point.lengths);
  }
  if (point.sections.size() > 0) {
    demand_count("sections", "segments", point.sections.size(), segments);
    model.set_section_scales(point.sections);
  } else if (!model.section_scales().isOnes(0)) {
    model.set_section_scales(Eigen::VectorXd::Ones(segments));
  }
}

DesignVariableMap::DesignVariableMap(const LinkageModel& model, DesignVariables which)
    : which_(which) {
  which_.validate();
  const int segments = model.variables().segments();
  if (which_.lengths == LengthVariables::kSegments) lengths_ = segments;
  if (which_.lengths == LengthVariables::kEdges) lengths_ = model.edge_numbers().size();
  if (which_.sections == SectionVariables::kSegments) sections_ = segments;
}

Eigen::VectorXd DesignVariableMap::values(const LinkageModel& model) const {
  Eigen::VectorXd result(size());
  if (which_.lengths == LengthVariables::kSegments) result.head(lengths_) = model.segment_lengths();
  if (which_.lengths == LengthVariables::kEdges) result.head(lengths_) = model.edge_lengths();
  if (sections_ > 0) result.tail(sections_) = model.section_scales();
  return result;
}

void DesignVariableMap::place(const LinkageModel& model,
                              const Eigen::Ref<const Eigen::VectorXd>& values,
                              DesignPoint& point) const {
  LIMBER_DEMAND(values.size() == size());
  if (which_.lengths == LengthVariables::kSegments) point.lengths = values.head(lengths_);
  if (which_.lengths == LengthVariables::kEdges) {
    point.edges = values.head(lengths_);
    point.lengths = model.edge_numbers().segment_lengths(point.edges);
  }
  if (sections_ > 0) point.sections = values.tail(sections_);
}

LinkageVector DesignVariableMap::direction(const Eigen::Ref<const Eigen::VectorXd>& change) const {
  LIMBER_DEMAND(change.size() == size());
  LinkageVector result;
  if (which_.lengths == LengthVariables::kSegments) result.lengths = change.head(lengths_);
  if (which_.lengths == LengthVariables::kEdges) result.edges = change.head(lengths_);
  if (sections_ > 0) result.sections = change.tail(sections_);
  return result;
}

Eigen::VectorXd DesignVariableMap::gradient(const LinkageVector& by) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(size());
  const Eigen::VectorXd& lengths =
      which_.lengths == LengthVariables::kEdges ? by.edges : by.lengths;
  if (lengths_ > 0 && lengths.size() > 0) result.head(lengths_) = lengths;
  if (sections_ > 0 && by.sections.size() > 0) result.tail(sections_) = by.sections;
  return result;
}

}  // namespace limber::rods
