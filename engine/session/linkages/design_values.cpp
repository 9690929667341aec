#include "engine/session/linkages/design_values.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <set>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/design/design_weight.h"

namespace limber::session {
namespace {

void demand(bool holds, const std::string& field, const char* rule, double value) {
  if (holds) return;
  throw Error(ErrorCode::kInvalidArgument, field, fmt::format("must be {}, is {:g}", rule, value));
}

template <class Holds>
void demand_bounds(const char* field, const Eigen::VectorXd& bounds, const Eigen::VectorXd& start,
                   const Holds& holds) {
  if (bounds.size() == 0) return;
  if (bounds.size() != start.size()) {
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("{} bounds for {} variables", bounds.size(), start.size()));
  }
  for (Eigen::Index s = 0; s < bounds.size(); ++s) {
    if (holds(bounds[s], start[s]) && std::isfinite(bounds[s])) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}[{}]", field, s),
                fmt::format("the start, {:g}, is beyond the bound {:g}", start[s], bounds[s]));
  }
}

}  // namespace

std::shared_ptr<const rods::TargetSurface> DesignGoal::placed_surface() const {
  if (!surface) return nullptr;
  return std::make_shared<rods::PlacedSurface>(surface, placement);
}

void DesignGoal::validate(int joints) const {
  demand(flat_share >= 0 && flat_share <= 1, "flat_share", "in [0, 1]", flat_share);
  rods::demand_design_weight("distance_weight", distance_weight);
  rods::demand_design_weight("surface_weight", surface_weight);
  try {
    placement.validate();
  } catch (const Error& error) {
    throw Error(error.code(), "placement." + error.field(), error.what());
  }
  std::set<int> distinct_joints;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const rods::JointTarget& target = targets[i];
    const std::string field = fmt::format("targets[{}]", i);
    if (target.joint < 0 || target.joint >= joints) {
      throw Error(ErrorCode::kOutOfRange, field + ".joint",
                  fmt::format("joint {} is outside 0 .. {}", target.joint, joints - 1));
    }
    if (!distinct_joints.insert(target.joint).second) {
      throw Error(ErrorCode::kInvalidArgument, field + ".joint",
                  fmt::format("joint {} has two targets", target.joint));
    }
    if (!target.position.allFinite())
      throw Error(ErrorCode::kInvalidArgument, field + ".position", "must be finite");
    rods::demand_design_weight(field + ".weight", target.weight);
  }
  const Eigen::VectorXd& weights = joint_surface_weights;
  if (weights.size() != 0 && weights.size() != joints) {
    throw Error(ErrorCode::kInvalidArgument, "joint_surface_weights",
                fmt::format("{} weights for {} joints", weights.size(), joints));
  }
  for (Eigen::Index j = 0; j < weights.size(); ++j)
    rods::demand_design_weight(fmt::format("joint_surface_weights[{}]", j), weights[j]);
  if (targets.empty() && !surface) {
    throw Error(ErrorCode::kInvalidArgument, "targets",
                "nothing to design for: neither targets nor a surface");
  }
}

void DesignRequest::validate(int joints, const DesignStart& start) const {
  try {
    goal.validate(joints);
  } catch (const Error& error) {
    throw Error(error.code(), "goal." + error.field(), error.what());
  }
  demand(shortest > 0 && shortest < 1, "shortest",
         "in (0, 1): rest lengths begin at 1, which bounds may not exclude", shortest);
  demand(longest > 1 && longest <= 10, "longest",
         "in (1, 10]: rest lengths begin at 1, which bounds may not exclude", longest);
  if (flat_height)
    demand(*flat_height > 0 && std::isfinite(*flat_height), "flat_height", "> 0 and finite",
           *flat_height);
  if (flat_angle) {
    demand(std::abs(*flat_angle) < std::numbers::pi, "flat_angle", "in (-180, 180) degrees",
           *flat_angle * kDegreesPerRadian);
  }
  if (smallest_angle) {
    demand(std::abs(*smallest_angle) < std::numbers::pi, "smallest_angle", "in (-180, 180) degrees",
           *smallest_angle * kDegreesPerRadian);
    if (flat_angle) {
      demand(*smallest_angle < *flat_angle, "smallest_angle",
             "below the mean that the flat shape is held at", *smallest_angle * kDegreesPerRadian);
    }
  }
  demand(least_cover >= 0 && least_cover <= 1, "least_cover", "in [0, 1]", least_cover);
  demand(max_iterations > 0, "max_iterations", "> 0", max_iterations);
  demand(thinnest > 0 && thinnest < 1, "thinnest",
         "in (0, 1): scales begin at 1, which bounds may not exclude", thinnest);
  demand(thickest > 1 && thickest <= 10, "thickest",
         "in (1, 10]: scales begin at 1, which bounds may not exclude", thickest);
  if (fitted_points.cols() != 0 && fitted_points.cols() != joints) {
    throw Error(ErrorCode::kInvalidArgument, "fitted_points",
                fmt::format("{} points for {} joints", fitted_points.cols(), joints));
  }
  variables.validate();
  if (variables.lengths == rods::LengthVariables::kSegments && start.by_edges) {
    throw Error(ErrorCode::kFailedPrecondition, "lengths",
                "edges have rest lengths of their own: vary those of edges, or set those of "
                "segments first");
  }
  const Eigen::VectorXd none;
  const Eigen::VectorXd& lengths =
      variables.lengths == rods::LengthVariables::kSegments ? start.segments
      : variables.lengths == rods::LengthVariables::kEdges  ? start.edges
                                                            : none;
  const Eigen::VectorXd& sections =
      variables.sections == rods::SectionVariables::kSegments ? start.sections : none;
  const auto not_above = [](double bound, double size) { return bound > 0 && bound <= size; };
  const auto not_below = [](double bound, double size) { return bound >= size; };
  demand_bounds("shortest_lengths", shortest_lengths, lengths, not_above);
  demand_bounds("longest_lengths", longest_lengths, lengths, not_below);
  demand_bounds("thinnest_sections", thinnest_sections, sections, not_above);
  demand_bounds("thickest_sections", thickest_sections, sections, not_below);
}

void DesignChange::apply_to(DesignGoal& goal) const {
  if (flat_share) goal.flat_share = *flat_share;
  if (distance_weight) goal.distance_weight = *distance_weight;
  if (surface_weight) goal.surface_weight = *surface_weight;
  if (targets) goal.targets = *targets;
  if (surface) {
    goal.surface = *surface;
    goal.placement = {};
  }
  if (placement) goal.placement = *placement;
  if (joint_surface_weights) goal.joint_surface_weights = *joint_surface_weights;
}

std::shared_ptr<const scene::LinkageErection> without_erection(const std::string& reason) {
  auto erection = std::make_shared<scene::LinkageErection>();
  erection->failure = reason;
  return erection;
}

std::shared_ptr<const scene::LinkageErection> erection_of(const DesignInfo& info) {
  if (info.erection) return info.erection;
  return without_erection(
      "no erection was searched for, since the design was stopped: start a design from the taken "
      "one to find it");
}

}  // namespace limber::session
