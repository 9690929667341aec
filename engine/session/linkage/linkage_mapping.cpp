#include "engine/session/linkage/linkage_mapping.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"

namespace limber::session {
namespace {

void demand_positive(double value, const char* field) {
  if (value > 0 && std::isfinite(value)) return;
  throw Error(ErrorCode::kInvalidArgument, field,
              fmt::format("must be > 0 and finite, is {:g}", value));
}

/// Errors of the rods wing, with the scene's path.
template <class Call>
auto with_prefix(const char* prefix, const Call& call) {
  try {
    return call();
  } catch (const Error& error) {
    if (error.field().rfind(prefix, 0) == 0) throw;
    throw Error(error.code(), std::string(prefix) + error.field(), error.what());
  }
}

rods::Hold map_hold(scene::Held held) {
  switch (held) {
    case scene::Held::kMotion:
      return rods::Hold::kMotion;
    case scene::Held::kAngle:
      return rods::Hold::kAngle;
    case scene::Held::kMotionAndAngle:
      break;
  }
  return rods::Hold::kMotionAndAngle;
}

/// Rods reach half an edge beyond their joints: a share of the way from joint to joint as one of
/// the way from a rod's first vertex to its last, both counted in edges.
double share_of_rod(const rods::LinkageModel& model, int segment, double share) {
  const double edges = model.variables().edges(segment);
  const auto& joints = model.graph().segments[static_cast<std::size_t>(segment)].joints;
  const double from = joints[0] >= 0 ? 0.5 : 0, to = joints[1] >= 0 ? edges - 0.5 : edges;
  return (from + share * (to - from)) / edges;
}

}  // namespace

MappedLinkage map_linkage(const scene::Linkage& linkage) {
  const double unit = linkage.length_unit_in_metres;
  demand_positive(unit, "length_unit_in_metres");
  demand_positive(linkage.youngs_modulus, "youngs_modulus");
  if (!(linkage.density >= 0) || !std::isfinite(linkage.density)) {
    throw Error(ErrorCode::kInvalidArgument, "density",
                fmt::format("must be >= 0 and finite, is {:g}", linkage.density));
  }
  if (!(linkage.poissons_ratio > -1 && linkage.poissons_ratio <= 0.5)) {
    throw Error(ErrorCode::kInvalidArgument, "poissons_ratio",
                fmt::format("must be in (-1, 0.5], is {:g}", linkage.poissons_ratio));
  }
  const rods::SectionProperties section =
      with_prefix("section.", [&] { return rods::section_properties(linkage.section); });
  const rods::SectionStiffness stiffness = rods::section_stiffness(
      section, {linkage.youngs_modulus * unit * unit, linkage.poissons_ratio}, linkage.stiff_axis);
  rods::LinkageGraph graph =
      with_prefix("lines.", [&] { return rods::build_linkage_graph(linkage.lines); });
  return {rods::LinkageModel(
              std::move(graph), linkage.edges_per_segment,
              {stiffness.stretching, stiffness.bending_1, stiffness.bending_2, stiffness.torsion},
              linkage.bending),
          linkage.density * section.area * unit * unit * unit};
}

rods::Conditions map_conditions(const scene::LinkageConditions& conditions,
                                const MappedLinkage& linkage, double length_unit) {
  rods::Conditions mapped;
  for (const auto& pin : conditions.pins)
    mapped.pins.push_back({pin.joint, map_hold(pin.held), pin.position});
  for (const auto& wanted : conditions.angles)
    mapped.angles.push_back({wanted.joint, wanted.angle});
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

}  // namespace limber::session
