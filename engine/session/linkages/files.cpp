#include "engine/session/linkages/files.h"

#include <algorithm>
#include <cmath>

#include "engine/base/degrees.h"
#include "engine/rods/equilibrium/linkage_forces.h"
#include "engine/scene/formats/json_writer.h"
#include "engine/scene/formats/precision.h"

namespace limber::session {
namespace {

using scene::formats::JsonWriter;

constexpr RodFieldName kNames[rods::kRodFields] = {
    {"axial_strain", "1"},           {"axial_force", "N"},
    {"curvature_1", "1/length"},     {"curvature_2", "1/length"},
    {"twist_rate", "rad/length"},    {"bending_moment_1", "N m"},
    {"bending_moment_2", "N m"},     {"torque", "N m"},
    {"largest_normal_stress", "Pa"}, {"smallest_normal_stress", "Pa"},
    {"torsion_shear_stress", "Pa"},  {"von_mises_stress", "Pa"}};

Eigen::Index count_of(const LinkageDetail& detail, std::size_t segment) {
  return detail.first[segment + 1] - detail.first[segment];
}

/// A field along a segment.
auto along(const LinkageDetail& detail, std::size_t segment, int field) {
  return detail.fields.row(field).segment(detail.first[segment], count_of(detail, segment));
}

double angle_at(const LinkageDetail& detail, int joint) {
  return joint < 0 ? 0 : detail.joints[static_cast<std::size_t>(joint)].opening_angle / kDegree;
}

/// One row a segment, as line data.
template <class Value>
scene::Polylines::Array line_array(const LinkageDetail& detail, const char* name,
                                   const Value& value) {
  Eigen::MatrixXf values(1, static_cast<Eigen::Index>(detail.segments.size()));
  for (std::size_t s = 0; s < detail.segments.size(); ++s)
    values(0, static_cast<Eigen::Index>(s)) = static_cast<float>(value(s));
  return {name, std::move(values)};
}

/// The same of both ends.
template <class Value>
scene::Polylines::Array end_array(const LinkageDetail& detail, const char* name,
                                  const Value& value) {
  Eigen::MatrixXf values(2, static_cast<Eigen::Index>(detail.segments.size()));
  for (std::size_t s = 0; s < detail.segments.size(); ++s)
    for (std::size_t end = 0; end < 2; ++end)
      values(static_cast<Eigen::Index>(end), static_cast<Eigen::Index>(s)) =
          static_cast<float>(value(detail.segments[s].joints[end]));
  return {name, std::move(values)};
}

/// Text of numbers that were float32 shows no more digits than they had.
void numbers(JsonWriter& json, const char* name, const Eigen::Ref<const Eigen::VectorXd>& values) {
  json.key(name);
  json.numbers(values.cast<float>());
}

/// Far from the origin the digits of single precision are too few.
void write_position(JsonWriter& json, const LinkageDetail& detail, const Eigen::Vector3d& at) {
  if (scene::precision_for(detail.points) == scene::Precision::kFloat64) {
    json.numbers(at);
  } else {
    json.numbers(at.cast<float>());
  }
}

void write_units(const scene::Linkage& linkage, JsonWriter& json) {
  json.member("length_unit_in_metres", linkage.length_unit_in_metres);
  json.key("units");
  json.begin_object();
  json.member("length", "length_unit_in_metres metres");
  json.member("angle", "degree");
  for (const RodFieldName& field : kNames) json.member(field.name, field.unit);
  json.member("force", "N");
  json.member("moment", "N m");
  json.end_object();
}

void vector(JsonWriter& json, const char* name, const Eigen::Vector3d& of) {
  json.key(name);
  json.begin_array();
  for (const double component : of) json.value(component);
  json.end_array();
}

void write_joint(const LinkageDetail& detail, const LinkageGeometry& geometry,
                 const rods::LinkageForces& forces, std::size_t j, JsonWriter& json) {
  const LinkageDetail::Joint& joint = detail.joints[j];
  json.begin_object();
  json.member("joint", static_cast<int>(j));
  json.member("vertex", geometry.vertex_of_joint[j]);
  json.key("position");
  write_position(json, detail, joint.position);
  numbers(json, "normal", joint.normal);
  json.member("opening_angle", joint.opening_angle / kDegree);
  const auto column = static_cast<Eigen::Index>(j);
  vector(json, "load", forces.loads.col(column));
  vector(json, "reaction_force", forces.reaction_forces.col(column));
  vector(json, "reaction_moment", forces.reaction_moments.col(column));
  vector(json, "unbalanced_force", forces.unbalanced_forces.col(column));
  json.end_object();
}

void write_springs(const rods::LinkageForces& forces, JsonWriter& json) {
  json.key("springs");
  json.begin_array();
  for (const auto& spring : forces.springs) {
    json.begin_object();
    vector(json, "point", spring.point);
    vector(json, "force", spring.force);
    json.end_object();
  }
  json.end_array();
}

/// Writes the forces of a segment on its joints.
void write_ends(const rods::LinkageForces& forces, std::size_t s, JsonWriter& json) {
  const auto segment = static_cast<Eigen::Index>(s);
  vector(json, "weight", forces.weights.col(segment));
  const auto both = [&](const char* name, const Eigen::Matrix3Xd& of) {
    json.key(name);
    json.begin_array();
    for (const Eigen::Index end : {2 * segment, 2 * segment + 1}) {
      json.begin_array();
      for (const double component : of.col(end)) json.value(component);
      json.end_array();
    }
    json.end_array();
  };
  both("end_forces", forces.end_forces);
  both("end_moments", forces.end_moments);
}

/// In N and N m. If a shape was reached, springs are those of the request, one by one; if a path
/// ended, those that hold it there.
rods::LinkageForces forces_of(const LinkageResult& result, double length_unit) {
  const LinkageStatics& statics = *result.statics;
  const bool is_reached = result.report.converged() && !result.solve_failed && result.requested;
  rods::LinkageForces forces = rods::forces_in(
      statics.model(), *result.state,
      is_reached ? map_conditions(*result.requested, statics.mapped(), length_unit) : *result.held);
  forces.reaction_moments *= length_unit;
  forces.end_moments *= length_unit;
  return forces;
}

void write_extremes(const LinkageDetail& detail, std::size_t s, JsonWriter& json) {
  json.key("extremes");
  json.begin_object();
  for (int field = 0; field < rods::kRodFields; ++field) {
    const auto values = along(detail, s, field);
    if (!values.allFinite()) continue;
    Eigen::Index least = 0, most = 0;
    const double smallest = values.minCoeff(&least), largest = values.maxCoeff(&most);
    json.key(kNames[field].name);
    json.begin_object();
    json.member("smallest", static_cast<float>(smallest));
    json.member("smallest_at", static_cast<int>(least));
    json.member("largest", static_cast<float>(largest));
    json.member("largest_at", static_cast<int>(most));
    json.end_object();
  }
  json.end_object();
}

void write_rods(const LinkageGeometry& geometry, JsonWriter& json) {
  json.key("rods");
  json.begin_array();
  for (const rods::RodChain& rod : geometry.rods) {
    json.begin_object();
    json.key("segments");
    json.begin_array();
    for (const int segment : rod.segments) json.value(segment);
    json.end_array();
    json.key("reversed");
    json.begin_array();
    for (const char reversed : rod.reversed) json.value(reversed != 0);
    json.end_array();
    json.member("closed", rod.is_closed);
    json.end_object();
  }
  json.end_array();
}

void write_segment(const LinkageDetail& detail, const rods::LinkageForces& forces, std::size_t s,
                   JsonWriter& json) {
  const LinkageDetail::Segment& segment = detail.segments[s];
  json.begin_object();
  json.member("segment", static_cast<int>(s));
  json.key("joints");
  json.begin_array();
  for (const int joint : segment.joints) {
    if (joint < 0) {
      json.null();
    } else {
      json.value(joint);
    }
  }
  json.end_array();
  json.key("opening_angles");
  json.begin_array();
  for (const int joint : segment.joints) {
    if (joint < 0) {
      json.null();
    } else {
      json.value(angle_at(detail, joint));
    }
  }
  json.end_array();
  json.member("rest_length", segment.rest_length);
  json.member("length", segment.length);
  json.member("section_scale", segment.section_scale);
  write_ends(forces, s, json);
  write_extremes(detail, s, json);
  json.key("stations");
  json.begin_object();
  json.key("position");
  json.begin_array();
  for (Eigen::Index i = detail.first[s]; i < detail.first[s + 1]; ++i)
    write_position(json, detail, detail.points.col(i));
  json.end_array();
  json.key("director_1");
  json.begin_array();
  for (Eigen::Index i = detail.first[s]; i < detail.first[s + 1]; ++i)
    json.numbers(detail.directors.col(i).cast<float>());
  json.end_array();
  for (int field = 0; field < rods::kRodFields; ++field)
    numbers(json, kNames[field].name, along(detail, s, field).transpose());
  json.end_object();
  json.end_object();
}

}  // namespace

RodFieldName name_of(rods::RodField field) { return kNames[field]; }

scene::Polylines linkage_lines(const LinkageDetail& detail) {
  scene::Polylines lines;
  lines.points = detail.points;
  for (std::size_t s = 0; s < detail.segments.size(); ++s) {
    auto& line = lines.lines.emplace_back();
    for (int i = detail.first[s]; i < detail.first[s + 1]; ++i) line.push_back(i);
  }
  for (int field = 0; field < rods::kRodFields; ++field) {
    if (detail.fields.row(field).allFinite())
      lines.point_data.push_back({kNames[field].name, detail.fields.row(field).cast<float>()});
  }
  lines.point_data.push_back({"director_1", detail.directors.cast<float>()});
  auto& data = lines.line_data;
  data.push_back(line_array(detail, "segment", [](std::size_t s) { return s; }));
  data.push_back(end_array(detail, "joints", [](int joint) { return joint; }));
  data.push_back(
      end_array(detail, "opening_angles", [&](int joint) { return angle_at(detail, joint); }));
  data.push_back(line_array(detail, "rest_length",
                            [&](std::size_t s) { return detail.segments[s].rest_length; }));
  data.push_back(
      line_array(detail, "length", [&](std::size_t s) { return detail.segments[s].length; }));
  for (const int field :
       {rods::kLargestNormal, rods::kSmallestNormal, rods::kTorsionShear, rods::kVonMises}) {
    if (!detail.fields.row(field).allFinite()) continue;
    const std::string name = std::string("segment_") + kNames[field].name;
    data.push_back(line_array(detail, name.c_str(), [&](std::size_t s) {
      const auto values = along(detail, s, field);
      return field == rods::kSmallestNormal ? values.minCoeff() : values.maxCoeff();
    }));
  }
  return lines;
}

scene::Polylines linkage_centrelines(const LinkageDetail& detail) {
  scene::Polylines lines;
  std::vector<Eigen::Vector3d> points;
  for (const auto& joint : detail.joints) points.push_back(joint.position);
  for (std::size_t s = 0; s < detail.segments.size(); ++s) {
    auto& line = lines.lines.emplace_back();
    for (int i = detail.first[s]; i < detail.first[s + 1]; ++i) {
      const int joint = i == detail.first[s]           ? detail.segments[s].joints[0]
                        : i + 1 == detail.first[s + 1] ? detail.segments[s].joints[1]
                                                       : -1;
      line.push_back(joint >= 0 ? joint : static_cast<int>(points.size()));
      if (joint < 0) points.emplace_back(detail.points.col(i));
    }
  }
  lines.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    lines.points.col(static_cast<Eigen::Index>(i)) = points[i];
  return lines;
}

std::string linkage_json(const LinkageDetail& detail, const scene::Linkage& linkage,
                         const LinkageGeometry& geometry, const LinkageResult& result) {
  JsonWriter json;
  json.begin_object();
  json.member("format", "limber linkage shape");
  json.member("version", 1);
  json.member("name", linkage.name);
  json.member("revision", result.revision);
  json.member("solve_failed", result.solve_failed);
  json.member("mean_opening_angle", result.mean_angle / kDegree);
  json.key("energy");
  json.begin_object();
  const double unit = linkage.length_unit_in_metres;
  json.member("unit", "J");
  json.member("stretching", result.report.energies.stretching * unit);
  json.member("bending", result.report.energies.bending * unit);
  json.member("twisting", result.report.energies.twisting * unit);
  json.end_object();
  write_units(linkage, json);
  const rods::LinkageForces forces = forces_of(result, unit);
  write_springs(forces, json);
  json.key("joints");
  json.begin_array();
  for (std::size_t j = 0; j < detail.joints.size(); ++j)
    write_joint(detail, geometry, forces, j, json);
  json.end_array();
  json.key("segments");
  json.begin_array();
  for (std::size_t s = 0; s < detail.segments.size(); ++s) write_segment(detail, forces, s, json);
  json.end_array();
  write_rods(geometry, json);
  json.end_object();
  return json.text();
}

}  // namespace limber::session
