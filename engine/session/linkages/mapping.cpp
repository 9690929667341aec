#include "engine/session/linkages/mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/rods/linkage/edge_counts.h"
#include "engine/session/linkages/condition_rules.h"
#include "engine/session/linkages/edge_choice.h"

namespace limber::session {
namespace {

constexpr double kMaxTolerance = 0.1;

/// Distance from the origin over the shortest segment.
constexpr double kFarthest = 5e4;

/// Collects errors of the rods wing as issues, with the scene's path.
template <class Call>
void note(std::vector<scene::Issue>& issues, const std::string& prefix, const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    // Normals are no part of the lines in a scene.
    const bool whole = error.field().rfind(prefix, 0) == 0 || error.field().starts_with("normals");
    issues.push_back({scene::Issue::Severity::kError,
                      whole ? error.field() : prefix + error.field(), error.what(), error.code()});
  }
}

void check_numbers(const scene::Linkage& linkage, std::vector<scene::Issue>& issues) {
  const auto refuse = [&](const char* field, const char* demand, double value) {
    issues.push_back(
        {scene::Issue::Severity::kError, field, fmt::format("must be {}, is {:g}", demand, value)});
  };
  const double unit = linkage.length_unit_in_metres, young = linkage.youngs_modulus;
  if (!(unit > 0 && std::isfinite(unit))) refuse("length_unit_in_metres", "> 0 and finite", unit);
  if (!(young > 0 && std::isfinite(young)))
    refuse("material.youngs_modulus", "> 0 and finite", young);
  if (!(linkage.density >= 0 && std::isfinite(linkage.density)))
    refuse("material.density", ">= 0 and finite", linkage.density);
  if (linkage.tolerance != 0 && !(linkage.tolerance > 0 && linkage.tolerance <= kMaxTolerance))
    refuse("tolerance", "in (0, 0.1]", linkage.tolerance);
  if (linkage.edges_per_segment == 0) {
    const bool by_edges = linkage.conditions.edge_lengths.size() > 0 || linkage.shape.has_value();
    if (by_edges || linkage.tolerance == 0) {
      issues.push_back({scene::Issue::Severity::kError, "edges_per_segment",
                        by_edges ? "must be named where the scene has a shape or edge_lengths, "
                                   "which are of so many edges"
                                 : "must be named where there is no tolerance"});
    }
  }
  if (!(linkage.poissons_ratio > -1 && linkage.poissons_ratio <= 0.5))
    refuse("material.poissons_ratio", "in (-1, 0.5]", linkage.poissons_ratio);
}

constexpr std::pair<scene::Held, rods::Hold> kHolds[] = {
    {scene::Held::kMotion, rods::Hold::kMotion},
    {scene::Held::kAngle, rods::Hold::kAngle},
    {scene::Held::kMotionAndAngle, rods::Hold::kMotionAndAngle},
};

rods::Hold map_hold(scene::Held held) {
  return std::find_if(std::begin(kHolds), std::end(kHolds),
                      [&](const auto& pair) { return pair.first == held; })
      ->second;
}
scene::Held scene_hold(rods::Hold hold) {
  return std::find_if(std::begin(kHolds), std::end(kHolds),
                      [&](const auto& pair) { return pair.second == hold; })
      ->first;
}

/// With rods of a mass per length. Between two conditions gravity has weights, and masses of 1.
Eigen::Vector3d acceleration_of(const rods::Gravity& gravity, double mass_per_length) {
  if (gravity.mass_per_length == mass_per_length) return gravity.acceleration;
  if (!(mass_per_length > 0)) return Eigen::Vector3d::Zero();
  return gravity.mass_per_length / mass_per_length * gravity.acceleration;
}

/// A segment at rest, from its first vertex to its last. Rods reach half an edge beyond their
/// joints, and edges at joints are of other lengths than those between.
struct SegmentAtRest {
  SegmentAtRest(const rods::LinkageModel& model, int segment)
      : along(static_cast<std::size_t>(model.variables().edges(segment)) + 1, 0.0) {
    const auto& joints = model.graph().segments[static_cast<std::size_t>(segment)].joints;
    for (std::size_t e = 0; e + 1 < along.size(); ++e) {
      along[e + 1] = along[e] + model.rest_lengths().edge(model.graph(), model.variables(), segment,
                                                          static_cast<int>(e));
    }
    const std::size_t edges = along.size() - 1;
    from = joints[rods::kStart] >= 0 ? along[1] / 2 : 0;
    to = joints[rods::kFinish] >= 0 ? (along[edges - 1] + along[edges]) / 2 : along[edges];
  }
  std::vector<double> along;  // where its vertices are [length]
  double from = 0, to = 0;    // its ends: the joints, or the vertices of free ends
};

/// A share of a segment's length from end to end as one of its edges from the first vertex to the
/// last, as rods::ArcPoint counts.
double share_of_rod(const rods::LinkageModel& model, int segment, double share) {
  const SegmentAtRest rest(model, segment);
  const double at = rest.from + share * (rest.to - rest.from);
  const auto edges = static_cast<std::ptrdiff_t>(rest.along.size()) - 1;
  const auto next = std::upper_bound(rest.along.begin(), rest.along.end(), at);
  const std::ptrdiff_t edge =
      std::clamp<std::ptrdiff_t>(next - rest.along.begin() - 1, 0, edges - 1);
  const auto e = static_cast<std::size_t>(edge);
  const double part = (at - rest.along[e]) / (rest.along[e + 1] - rest.along[e]);
  return std::min((static_cast<double>(edge) + part) / static_cast<double>(edges), 1.0);
}
double share_between_joints(const rods::LinkageModel& model, int segment, double share) {
  const SegmentAtRest rest(model, segment);
  const double place = share * static_cast<double>(rest.along.size() - 1);
  const auto edge = std::min(static_cast<std::size_t>(place), rest.along.size() - 2);
  const double part = place - static_cast<double>(edge);
  const double at = (1 - part) * rest.along[edge] + part * rest.along[edge + 1];
  return std::clamp((at - rest.from) / (rest.to - rest.from), 0.0, 1.0);
}

/// Coordinates are numbers of 16 digits: far from the origin too few are left for short edges.
void check_place(const scene::Linkage& linkage, const rods::LinkageGraph& graph,
                 std::vector<scene::Issue>& issues) {
  const auto shortest = std::min_element(
      graph.segments.begin(), graph.segments.end(),
      [](const rods::Segment& a, const rods::Segment& b) { return a.length < b.length; });
  const double farthest = linkage.lines.vertices.cwiseAbs().maxCoeff();
  if (farthest <= kFarthest * shortest->length) return;
  issues.push_back(
      {scene::Issue::Severity::kError, "lines",
       fmt::format("vertices lie up to {:g} from the origin, and edge {} is {:g} long: "
                   "too little for numbers of 16 digits. Move the linkage to the "
                   "origin, or leave out edges that short",
                   farthest, shortest - graph.segments.begin(), shortest->length),
       ErrorCode::kOutOfRange});
}

}  // namespace

int first_edges(const scene::Linkage& linkage) {
  return linkage.edges_per_segment == 0 ? kUsualEdges : linkage.edges_per_segment;
}

LinkageCheck check_linkage(const scene::Linkage& linkage) {
  LinkageCheck check;
  auto& issues = check.issues;
  check_numbers(linkage, issues);
  note(issues, "section.", [&] { rods::validate(linkage.section); });
  if (linkage.lines.edge_count() == 0) {
    issues.push_back({scene::Issue::Severity::kError, "lines", "there are no edges"});
    return check;
  }
  std::optional<rods::LinkageGraph> graph;
  note(issues, "lines.", [&] { graph = rods::build_linkage_graph(linkage.lines); });
  if (!graph) return check;
  check.joints = static_cast<int>(graph->joints.size());
  check.segments = static_cast<int>(graph->segments.size());
  std::optional<ConditionRules> rules;
  try {
    rules.emplace(*graph, first_edges(linkage), linkage.length_unit_in_metres);
  } catch (const Error& error) {  // the scene has one number for all segments
    issues.push_back(
        {scene::Issue::Severity::kError, "edges_per_segment", error.what(), error.code()});
  }
  check_place(linkage, *graph, issues);
  auto faults = scene::validate(linkage.conditions, check.joints, check.segments);
  // In a shape, pins that contradict each other are one of the things that may have no equilibrium.
  if (faults.empty() && rules)
    faults =
        linkage.shape ? rules->check(linkage.conditions) : rules->check_drawn(linkage.conditions);
  const auto add = [&](const char* prefix) {
    for (auto& issue : faults) {
      // It is a field of the whole linkage, though edits change it with the conditions.
      if (!issue.field.starts_with("erection.")) issue.field = prefix + issue.field;
      issues.push_back(std::move(issue));
    }
  };
  add("conditions.");
  if (!linkage.shape || !rules) return check;
  note(issues, "shape.", [&] { rules->check_shape(*linkage.shape); });
  if (!linkage.shape_conditions) return check;
  faults = scene::validate(*linkage.shape_conditions, check.joints, check.segments);
  if (faults.empty()) faults = rules->check(*linkage.shape_conditions);
  add("shape.conditions.");
  return check;
}

void demand_sound(const LinkageCheck& check) {
  if (check.issues.empty()) return;
  const scene::Issue& first = check.issues.front();
  throw Error(first.code, first.field, first.message);
}

MappedLinkage map_linkage(const scene::Linkage& linkage) {
  demand_sound(check_linkage(linkage));
  const double unit = linkage.length_unit_in_metres;
  const rods::SectionProperties section = rods::section_properties(linkage.section);
  const rods::SectionStiffness stiffness = rods::section_stiffness(
      section, {linkage.youngs_modulus * unit * unit, linkage.poissons_ratio}, linkage.stiff_axis);
  rods::LinkageGraph graph = rods::build_linkage_graph(linkage.lines);
  std::vector<int> edges = rods::edges_by_length(graph, linkage.edges_per_segment);
  return {rods::LinkageModel(
              std::move(graph), std::move(edges),
              {stiffness.stretching, stiffness.bending_1, stiffness.bending_2, stiffness.torsion},
              linkage.bending),
          section, linkage.density * section.area * unit * unit * unit};
}

rods::Conditions map_conditions(const scene::LinkageConditions& conditions,
                                const MappedLinkage& linkage, double length_unit) {
  rods::Conditions mapped;
  for (const auto& pin : conditions.pins)
    mapped.pins.push_back({pin.joint, map_hold(pin.held), pin.position});
  for (const auto& setting : conditions.angles)
    mapped.angles.push_back({setting.joint, setting.angle});
  mapped.mean_opening_angle = conditions.mean_angle;
  for (const auto& target : conditions.targets) {
    rods::TargetSpring spring;
    if (target.joint >= 0) {
      spring.at = rods::JointPoint{target.joint};
    } else {
      spring.at =
          rods::ArcPoint{target.segment, share_of_rod(linkage.model, target.segment, target.share)};
    }
    spring.position = target.position;
    spring.stiffness = target.stiffness * length_unit;
    mapped.springs.push_back(spring);
  }
  for (const auto& load : conditions.loads) {
    mapped.loads.push_back(
        {load.joint, load.force, load.moment / length_unit, load.torque / length_unit});
  }
  mapped.gravity = {conditions.gravity, linkage.mass_per_length};
  return mapped;
}

scene::LinkageConditions scene_conditions(const rods::Conditions& conditions,
                                          const MappedLinkage& mapped, double length_unit) {
  scene::LinkageConditions result;
  for (const auto& pin : conditions.pins)
    result.pins.push_back({pin.joint, scene_hold(pin.hold), pin.position});
  for (const auto& setting : conditions.angles)
    result.angles.push_back({setting.joint, setting.angle});
  result.mean_angle = conditions.mean_opening_angle;
  for (const auto& spring : conditions.springs) {
    if (!(spring.stiffness > 0)) continue;
    scene::LinkageTarget target;
    if (const auto* const joint = std::get_if<rods::JointPoint>(&spring.at)) {
      target.joint = joint->joint;
    } else if (const auto* const arc = std::get_if<rods::ArcPoint>(&spring.at)) {
      target.segment = arc->segment;
      target.share = share_between_joints(mapped.model, arc->segment, arc->share);
    } else {
      continue;
    }
    target.position = spring.position;
    target.stiffness = spring.stiffness / length_unit;
    result.targets.push_back(target);
  }
  for (const auto& load : conditions.loads) {
    auto at =
        std::find_if(result.loads.begin(), result.loads.end(),
                     [&](const scene::JointLoad& other) { return other.joint == load.joint; });
    if (at == result.loads.end()) at = result.loads.insert(at, scene::JointLoad{load.joint});
    at->force += load.force;
    at->moment += load.moment * length_unit;
    at->torque += load.opening_torque * length_unit;
  }
  result.gravity = acceleration_of(conditions.gravity, mapped.mass_per_length);
  return result;
}

}  // namespace limber::session
