#include "engine/rods/design/design_optimizer.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/rods/design/design_search.h"

namespace limber::rods {
namespace {

void demand(bool holds, const char* field, const char* rule, double value) {
  if (holds) return;
  throw Error(ErrorCode::kInvalidArgument, field, fmt::format("must be {}, is {:g}", rule, value));
}

/// @param side  1: the start may not lie above the bound, -1: below
Eigen::VectorXd bounds(const char* field, const Eigen::VectorXd& given, double share,
                       const Eigen::VectorXd& start, int side) {
  if (given.size() == 0) return share * start;
  if (given.size() != start.size()) {
    throw Error(
        ErrorCode::kInvalidArgument, field,
        fmt::format("must be one for each of {} variables, are {}", start.size(), given.size()));
  }
  for (Eigen::Index s = 0; s < start.size(); ++s) {
    if (given[s] > 0 && std::isfinite(given[s]) && side * (given[s] - start[s]) >= 0) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}[{}]", field, s),
                fmt::format("is {:g}, which excludes the start's {:g}", given[s], start[s]));
  }
  return given;
}

Eigen::VectorXd stacked(const Eigen::VectorXd& lengths, const Eigen::VectorXd& sections) {
  Eigen::VectorXd all(lengths.size() + sections.size());
  all << lengths, sections;
  return all;
}

detail::DesignBounds bounds_of(const LinkageDesign& design, const DesignOptimizerOptions& options) {
  const Eigen::VectorXd lengths = design.parameters().head(design.variables().lengths());
  const Eigen::VectorXd sections = design.parameters().tail(design.variables().sections());
  return {
      stacked(
          bounds("shortest_lengths", options.shortest_lengths, options.shortest, lengths, -1),
          bounds("thinnest_sections", options.thinnest_sections, options.thinnest, sections, -1)),
      stacked(
          bounds("longest_lengths", options.longest_lengths, options.longest, lengths, 1),
          bounds("thickest_sections", options.thickest_sections, options.thickest, sections, 1))};
}

}  // namespace

void DesignOptimizerOptions::validate() const {
  demand(max_iterations > 0, "max_iterations", "> 0", max_iterations);
  demand(max_products > 0, "max_products", "> 0", max_products);
  demand(shortest > 0 && shortest < 1, "shortest", "in (0, 1)", shortest);
  demand(longest > 1 && std::isfinite(longest), "longest", "> 1 and finite", longest);
  demand(thinnest > 0 && thinnest < 1, "thinnest", "in (0, 1)", thinnest);
  demand(thickest > 1 && std::isfinite(thickest), "thickest", "> 1 and finite", thickest);
  demand(flat_height > 0, "flat_height", "> 0", flat_height);
  demand(smallest_angle < std::numbers::pi, "smallest_angle", "< pi", smallest_angle);
  demand(first_radius > 0 && first_radius < 1, "first_radius", "in (0, 1)", first_radius);
  demand(tolerance > 0 && tolerance < 1, "tolerance", "in (0, 1)", tolerance);
  demand(least_gain > 0, "least_gain", "> 0", least_gain);
}

DesignReport optimize_design(LinkageDesign& design, const DesignOptimizerOptions& options,
                             const JobContext& context, const DesignCallback& on_step,
                             const DesignEndCallback& on_end) {
  options.validate();
  return detail::DesignSearch(design, options, bounds_of(design, options))
      .run(context, on_step, on_end);
}

}  // namespace limber::rods
