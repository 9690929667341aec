#include "server/kinds/linkages/scene.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/degrees.h"
#include "server/kinds/linkages/section.h"
#include "server/kinds/linkages/shape.h"
#include "server/wire/arrays.h"
#include "server/wire/entries.h"
#include "server/wire/enum_table.h"
#include "server/wire/fields.h"
#include "server/wire/indices.h"
#include "server/wire/scene_fields.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

constexpr std::uint32_t kMaxEdges = 1000;  // of a segment
constexpr double kMaxTolerance = 0.1;

void demand_no_body(const proto::Scene& message, const std::string& prefix) {
  if (const auto* field = field_beside(message, {"name", "length_unit_in_metres", "linkage"}))
    throw invalid(prefix + field->name(), field->name() == "mesh"
                                              ? "a scene has a mesh or a linkage, not both"
                                              : "is of bodies: a linkage has no such field");
}

rods::LineMesh decode_lines(const proto::LineSource& source, const std::string& field,
                            const LineLoader& load_lines) {
  switch (source.source_case()) {
    case proto::LineSource::kArrays:
      return {decode_points(source.arrays().vertices(), field + ".arrays.vertices"),
              decode_pairs(source.arrays().edges(), field + ".arrays.edges")};
    case proto::LineSource::SOURCE_NOT_SET:
      throw invalid(field, "a linkage needs lines: path, file, arrays or sample");
    default:
      return load_lines(source, field);
  }
}

/// HELD_NOTHING is none of the engine's: an edit that releases.
constexpr EnumTable<scene::Held, proto::Held> kHeld{
    {scene::Held::kMotionAndAngle, proto::HELD_MOTION_AND_ANGLE},
    {scene::Held::kMotion, proto::HELD_MOTION},
    {scene::Held::kAngle, proto::HELD_ANGLE}};

scene::LinkageConditions decode_conditions(const proto::LinkageConditions& message,
                                           const std::string& field) {
  scene::LinkageConditions conditions;
  decode_entries(
      message.pins(), field + ".pins",
      [](const proto::JointPin& pin, const std::string& path) {
        if (pin.held() == proto::HELD_NOTHING)
          throw invalid(path + ".held", "a pin of a scene holds something");
        return decode_pin(pin, path);
      },
      conditions.pins);
  decode_entries(
      message.angles(), field + ".angles",
      [](const proto::JointAngle& angle, const std::string& path) {
        const int joint = decode_index(angle.joint(), path + ".joint");
        return scene::JointAngle{
            joint, decode_angle(angle.angle_degrees(), path + ".angle_degrees", joint)};
      },
      conditions.angles);
  if (message.has_mean_angle_degrees()) {
    conditions.mean_angle =
        decode_angle(message.mean_angle_degrees(), field + ".mean_angle_degrees");
  }
  decode_entries(message.targets(), field + ".targets", decode_target, conditions.targets);
  decode_entries(message.loads(), field + ".loads", decode_load, conditions.loads);
  conditions.gravity = decode_vector(message.gravity());
  conditions.segment_lengths = decode_numbers(message.segment_lengths());
  conditions.edge_lengths = decode_numbers(message.edge_lengths());
  conditions.section_scales = decode_numbers(message.section_scales());
  return conditions;
}

/// Degrees that decode_angle() makes this of, where there are such: the product alone is often off
/// by a last digit.
double exact_degrees(double radian) {
  const double degrees = to_degrees(radian);
  const double up = std::nextafter(degrees, 180), down = std::nextafter(degrees, -180);
  for (const double candidate :
       {degrees, up, down, std::nextafter(up, 180), std::nextafter(down, -180)}) {
    if (candidate * kDegree == radian && std::abs(candidate) < 180) return candidate;
  }
  return degrees;
}

void encode_load(const scene::JointLoad& load, proto::JointLoad& message) {
  message.set_joint(static_cast<std::uint32_t>(load.joint));
  encode_vector(load.force, *message.mutable_force());
  encode_vector(load.moment, *message.mutable_moment());
  message.set_torque(load.torque);
}

void encode_conditions(const scene::LinkageConditions& conditions,
                       proto::LinkageConditions& message) {
  for (const auto& pin : conditions.pins) {
    auto& added = *message.add_pins();
    added.set_joint(static_cast<std::uint32_t>(pin.joint));
    added.set_held(kHeld.encode(pin.held));
    if (pin.position) encode_vector(*pin.position, *added.mutable_position());
  }
  for (const auto& setting : conditions.angles) {
    auto& added = *message.add_angles();
    added.set_joint(static_cast<std::uint32_t>(setting.joint));
    added.set_angle_degrees(exact_degrees(setting.angle));
  }
  if (conditions.mean_angle) message.set_mean_angle_degrees(exact_degrees(*conditions.mean_angle));
  for (const auto& target : conditions.targets) {
    auto& added = *message.add_targets();
    added.set_id(target.id);
    if (target.joint >= 0) {
      added.set_joint(static_cast<std::uint32_t>(target.joint));
    } else {
      added.mutable_segment()->set_segment(static_cast<std::uint32_t>(target.segment));
      added.mutable_segment()->set_share(target.share);
    }
    encode_vector(target.position, *added.mutable_position());
    added.set_stiffness(target.stiffness);
  }
  for (const auto& load : conditions.loads) encode_load(load, *message.add_loads());
  if (!conditions.gravity.isZero(0)) encode_vector(conditions.gravity, *message.mutable_gravity());
  encode_numbers(conditions.segment_lengths, *message.mutable_segment_lengths());
  encode_numbers(conditions.edge_lengths, *message.mutable_edge_lengths());
  encode_numbers(conditions.section_scales, *message.mutable_section_scales());
}

constexpr EnumTable<rods::BendingForm, proto::RodBending, proto::RodBending_MAX> kBending{
    {rods::BendingForm::kTurningAngle, proto::ROD_BENDING_TURNING_ANGLE},
    {rods::BendingForm::kMaterialFrames, proto::ROD_BENDING_MATERIAL_FRAMES},
    {rods::BendingForm::kAveragedFrames, proto::ROD_BENDING_AVERAGED_FRAMES}};

constexpr EnumTable<rods::StiffAxis, proto::StiffAxis, proto::StiffAxis_MAX> kStiffAxes{
    {rods::StiffAxis::kAsGiven, proto::STIFF_AXIS_AS_GIVEN},
    {rods::StiffAxis::kD1, proto::STIFF_AXIS_D1},
    {rods::StiffAxis::kD2, proto::STIFF_AXIS_D2}};

constexpr EnumTable<scene::RestLengthChoice, proto::RestLengths, proto::RestLengths_MAX>
    kRestLengths{{scene::RestLengthChoice::kAsDrawn, proto::REST_LENGTHS_AS_DRAWN},
                 {scene::RestLengthChoice::kLeastStress, proto::REST_LENGTHS_LEAST_STRESS}};

}  // namespace

std::shared_ptr<const scene::LinkageErection> decode_erection(const proto::LinkageErection& message,
                                                              const std::string& field) {
  auto erection = std::make_shared<scene::LinkageErection>();
  erection->mean_angle = decode_angle(message.mean_angle_degrees(), field + ".mean_angle_degrees");
  for (int i = 0; i < message.push_size(); ++i)
    erection->push.push_back(decode_load(message.push(i), fmt::format("{}.push[{}]", field, i)));
  for (int i = 0; i < message.path_degrees_size(); ++i) {
    erection->path.push_back(
        decode_angle(message.path_degrees(i), fmt::format("{}.path_degrees[{}]", field, i)));
  }
  erection->distance = message.distance();
  if (message.has_flat_positions())
    erection->flat_positions = decode_points(message.flat_positions(), field + ".flat_positions");
  if (message.has_positions())
    erection->positions = decode_points(message.positions(), field + ".positions");
  erection->path_moments.assign(message.path_moments().begin(), message.path_moments().end());
  if (message.has_support()) erection->support = decode_load(message.support(), field + ".support");
  erection->failure = message.failure();
  return erection;
}

proto::LinkageErection encode_erection(const scene::LinkageErection& erection) {
  proto::LinkageErection message;
  message.set_mean_angle_degrees(exact_degrees(erection.mean_angle));
  for (const auto& load : erection.push) encode_load(load, *message.add_push());
  for (const double angle : erection.path) message.add_path_degrees(exact_degrees(angle));
  message.set_distance(erection.distance);
  if (erection.flat_positions.cols() > 0)
    *message.mutable_flat_positions() = encode_points_float64(erection.flat_positions);
  if (erection.positions.cols() > 0)
    *message.mutable_positions() = encode_points_float64(erection.positions);
  for (const double moment : erection.path_moments) message.add_path_moments(moment);
  if (erection.support) encode_load(*erection.support, *message.mutable_support());
  message.set_failure(erection.failure);
  return message;
}

scene::LinkageConditions decode_linkage_conditions(const proto::RodLinkage& message,
                                                   const std::string& field) {
  scene::LinkageConditions conditions =
      decode_conditions(message.conditions(), field + ".conditions");
  if (message.has_erection())
    conditions.erection = decode_erection(message.erection(), field + ".erection");
  return conditions;
}

proto::RodLinkage encode_linkage_conditions(const scene::LinkageConditions& conditions) {
  proto::RodLinkage message;
  encode_conditions(conditions, *message.mutable_conditions());
  if (conditions.erection) *message.mutable_erection() = encode_erection(*conditions.erection);
  return message;
}

double to_degrees(double radian) { return radian * kDegreesPerRadian; }

double decode_angle(double degrees, const std::string& field, std::optional<int> joint) {
  if (std::abs(degrees) < 180) return degrees * kDegree;  // NaN is none
  throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, field,
                fmt::format("{:g} degrees cannot be reached{}, must be in (-180, 180)", degrees,
                            joint ? fmt::format(" by joint {}", *joint) : ""));
}

scene::JointPin decode_pin(const proto::JointPin& message, const std::string& field) {
  scene::JointPin pin;
  pin.joint = decode_index(message.joint(), field + ".joint");
  pin.held = kHeld.decode(message.held());
  if (message.has_position()) pin.position = decode_vector(message.position());
  return pin;
}

scene::LinkageTarget decode_target(const proto::LinkageTarget& message, const std::string& field) {
  scene::LinkageTarget target;
  target.id = message.id();
  switch (message.at_case()) {
    case proto::LinkageTarget::kJoint:
      target.joint = decode_index(message.joint(), field + ".joint");
      break;
    case proto::LinkageTarget::kSegment:
      target.segment = decode_index(message.segment().segment(), field + ".segment.segment");
      if (message.segment().has_share()) target.share = message.segment().share();
      break;
    case proto::LinkageTarget::AT_NOT_SET:
      throw invalid(field, "a joint or a segment is expected");
  }
  if (!message.has_position()) throw invalid(field + ".position", "missing");
  target.position = decode_vector(message.position());
  target.stiffness = message.stiffness();
  return target;
}

scene::JointLoad decode_load(const proto::JointLoad& message, const std::string& field) {
  return {decode_index(message.joint(), field + ".joint"), decode_vector(message.force()),
          decode_vector(message.moment()), message.torque()};
}

scene::Linkage decode_linkage(const proto::Scene& message, const std::string& prefix,
                              const LineLoader& load_lines) {
  demand_no_body(message, prefix);
  const proto::RodLinkage& given = message.linkage();
  const std::string field = prefix + "linkage";
  scene::Linkage linkage;
  linkage.name = message.name();
  if (message.has_length_unit_in_metres())
    linkage.length_unit_in_metres = message.length_unit_in_metres();
  if (given.has_edges_per_segment()) {
    if (given.edges_per_segment() < 3 || given.edges_per_segment() > kMaxEdges) {
      throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, field + ".edges_per_segment",
                    fmt::format("{} must be in [3, {}]", given.edges_per_segment(), kMaxEdges));
    }
    linkage.edges_per_segment =
        decode_index(given.edges_per_segment(), field + ".edges_per_segment");
  }
  if (given.has_tolerance()) {
    linkage.tolerance = given.tolerance();
    if (!(linkage.tolerance > 0 && linkage.tolerance <= kMaxTolerance)) {
      throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, field + ".tolerance",
                    fmt::format("{:g} must be in (0, {:g}]", linkage.tolerance, kMaxTolerance));
    }
    if (!given.has_edges_per_segment()) linkage.edges_per_segment = 0;
  }
  linkage.section = decode_section(given.section(), field + ".section");
  linkage.stiff_axis = kStiffAxes.decode(given.stiff_axis());
  linkage.bending = kBending.decode(given.bending());
  linkage.rest_lengths = kRestLengths.decode(given.rest_lengths());
  const auto& material = given.material();
  if (material.has_youngs_modulus()) linkage.youngs_modulus = material.youngs_modulus();
  if (material.has_poissons_ratio()) linkage.poissons_ratio = material.poissons_ratio();
  if (material.has_density()) linkage.density = material.density();
  linkage.conditions = decode_linkage_conditions(given, field);
  if (given.has_shape()) linkage.shape = decode_linkage_shape(given.shape(), field + ".shape");
  if (given.shape().has_conditions()) {
    linkage.shape_conditions =
        decode_conditions(given.shape().conditions(), field + ".shape.conditions");
  }
  linkage.lines = decode_lines(given.lines(), field + ".lines", load_lines);
  if (given.has_normals())
    linkage.lines.normals = decode_points(given.normals(), field + ".normals");
  return linkage;
}

proto::Scene encode_linkage(const scene::Linkage& linkage) {
  proto::Scene message;
  message.set_name(linkage.name);
  message.set_length_unit_in_metres(linkage.length_unit_in_metres);
  auto& given = *message.mutable_linkage();
  if (linkage.edges_per_segment > 0)
    given.set_edges_per_segment(static_cast<std::uint32_t>(linkage.edges_per_segment));
  if (linkage.tolerance > 0) given.set_tolerance(linkage.tolerance);
  *given.mutable_section() = encode_section(linkage.section);
  given.set_stiff_axis(kStiffAxes.encode(linkage.stiff_axis));
  given.set_bending(kBending.encode(linkage.bending));
  given.set_rest_lengths(kRestLengths.encode(linkage.rest_lengths));
  given.mutable_material()->set_youngs_modulus(linkage.youngs_modulus);
  given.mutable_material()->set_poissons_ratio(linkage.poissons_ratio);
  given.mutable_material()->set_density(linkage.density);
  encode_conditions(linkage.conditions, *given.mutable_conditions());
  if (linkage.conditions.erection)
    *given.mutable_erection() = encode_erection(*linkage.conditions.erection);
  if (linkage.lines.normals.cols() > 0)
    *given.mutable_normals() = encode_points_float64(linkage.lines.normals);
  if (linkage.shape) *given.mutable_shape() = encode_linkage_shape(*linkage.shape);
  if (linkage.shape_conditions)
    encode_conditions(*linkage.shape_conditions, *given.mutable_shape()->mutable_conditions());
  return message;
}

std::string linkage_field_in(const proto::Scene& message, const std::string& field) {
  if (const auto place = find_field(message.linkage(), field)) return "linkage." + *place;
  return field;
}

}  // namespace limber::server
