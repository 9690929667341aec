#include "server/kinds/beams/structure.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <limits>

#include "engine/scene/formats/beam_job.h"
#include "engine/scene/formats/edge_formats.h"
#include "engine/session/beams/job_mapping.h"
#include "server/wire/entries.h"
#include "server/wire/fields.h"
#include "server/wire/indices.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

std::string at(const std::string& list, int index) { return fmt::format("{}[{}]", list, index); }

beams::SectionShape decode_shape(const proto::BeamSection& message, const std::string& field) {
  switch (message.shape_case()) {
    case proto::BeamSection::kRectangle:
      return beams::rectangle(message.rectangle().width(), message.rectangle().height());
    case proto::BeamSection::kTube:
      return beams::tube(message.tube().outer_radius(), message.tube().inner_radius());
    case proto::BeamSection::SHAPE_NOT_SET:
      break;
  }
  throw invalid(field, field + " needs a rectangle or a tube");
}

beams::BeamSection decode_section(const proto::BeamSection& message, const std::string& field) {
  return with_fields_of(message, field + ".", [&] {
    beams::BeamMaterial material{message.young(), message.poisson(), message.density(),
                                 message.yield_stress()};
    if (message.has_shear_modulus()) material.shear_modulus = message.shear_modulus();
    return beams::make_section(decode_shape(message, field), material);
  });
}

/// Columns: x_axis, y_axis made perpendicular to it, and what completes them.
/// Of a BeamSupport or BeamMotion.
template <class Message>
Eigen::Matrix3d decode_own_axes(const Message& message, const std::string& field) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (!message.has_x_axis() && !message.has_y_axis()) return axes;
  // Those that were read before come back as they are, to the last digit.
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  axes.col(0) = decode_vector(message.x_axis());
  axes.col(1) = decode_vector(message.y_axis());
  axes.col(2) = axes.col(0).cross(axes.col(1));
  if (std::abs(axes.col(0).squaredNorm() - 1) <= kRounding &&
      std::abs(axes.col(1).squaredNorm() - 1) <= kRounding &&
      std::abs(axes.col(0).dot(axes.col(1))) <= kRounding)
    return axes;
  axes.col(0) = decode_vector(message.x_axis()).normalized();
  const Eigen::Vector3d second = decode_vector(message.y_axis()).normalized();
  axes.col(1) = second - axes.col(0) * axes.col(0).dot(second);
  if (!(axes.col(0).norm() > 0.5)) throw invalid(field + ".x_axis", "an axis has a length");
  if (!(axes.col(1).norm() > 1e-6))
    throw invalid(field + ".y_axis", "has no length, or runs along x_axis");
  axes.col(1).normalize();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

void decode_axes(const google::protobuf::RepeatedField<std::uint32_t>& axes,
                 const std::string& field, std::array<bool, 3>& released) {
  for (int i = 0; i < axes.size(); ++i) {
    if (axes[i] < 1 || axes[i] > 3)
      throw invalid(at(field, i), fmt::format("axes are 1, 2 and 3, not {}", axes[i]));
    released[axes[i] - 1] = true;
  }
}

beams::EndRelease decode_release(const proto::BeamRelease& message, const std::string& field) {
  beams::EndRelease release;
  decode_axes(message.forces(), field + ".forces", release.forces);
  decode_axes(message.rotations(), field + ".rotations", release.rotations);
  return release;
}

beams::BeamElement decode_element(const proto::BeamElement& message, const std::string& field) {
  beams::BeamElement element;
  element.start = decode_index(message.start(), field + ".start");
  element.finish = decode_index(message.finish(), field + ".finish");
  element.section = decode_index(message.section(), field + ".section");
  if (message.kind() == proto::BEAM_KIND_CABLE) element.kind = beams::BeamKind::kCable;
  element.normal = decode_vector(message.normal());
  element.rest_length = message.rest_length();
  element.rest_curvature = decode_vector(message.rest_curvature());
  element.start_release = decode_release(message.start_release(), field + ".start_release");
  element.finish_release = decode_release(message.finish_release(), field + ".finish_release");
  return element;
}

beams::LoadDirection direction(bool follows) {
  return follows ? beams::LoadDirection::kFollowing : beams::LoadDirection::kFixed;
}

beams::BeamNode decode_node(const proto::BeamNode& message, const std::string& field) {
  if (!message.has_position()) throw invalid(field + ".position", "missing");
  beams::BeamNode node;
  node.position = decode_vector(message.position());
  if (message.has_normal()) node.normal = decode_vector(message.normal());
  return node;
}

const std::string& companion(const proto::MeshFile& message, const std::string& name,
                             const std::string& field) {
  const auto found = message.companions().find(name);
  if (found == message.companions().end())
    throw invalid(field + ".companions", fmt::format("the job needs {}, which is missing", name));
  return found->second;
}

/// Everything but a check of the whole.
DecodedBeams read_structure(const proto::BeamStructure& message, const std::string& field) {
  DecodedBeams read;
  read.name = message.name();
  read.sections.assign(message.sections().begin(), message.sections().end());
  beams::BeamModel& model = read.model;
  decode_entries(message.nodes(), field + ".nodes", decode_node, model.nodes);
  decode_entries(message.sections(), field + ".sections", decode_section, model.sections);
  decode_entries(message.elements(), field + ".elements", decode_element, model.elements);
  model = with_conditions(std::move(model), decode_beam_conditions(message, field));
  give_motions_precedence(model);
  return read;
}

void add_drawing(const scene::EdgeMesh& drawing, beams::BeamModel& model) {
  for (Eigen::Index i = 0; i < drawing.vertices.cols(); ++i)
    model.nodes.push_back({drawing.vertices.col(i), drawing.normals.col(i)});
  for (const auto& [start, finish] : drawing.edges) {
    beams::BeamElement element;
    element.start = start;
    element.finish = finish;
    model.elements.push_back(element);
  }
}

/// The one section of a job.
proto::BeamSection section_of(const scene::BeamJob& job) {
  proto::BeamSection section;
  section.mutable_rectangle()->set_width(job.section_width);
  section.mutable_rectangle()->set_height(job.section_height);
  section.set_young(job.young);
  section.set_poisson(job.poisson);
  return section;
}

}  // namespace

beams::BeamSupport decode_support(const proto::BeamSupport& message, const std::string& field) {
  beams::BeamSupport support;
  support.node = decode_index(message.node(), field + ".node");
  support.fixed = {message.fix_x(),          message.fix_y(),          message.fix_z(),
                   message.fix_rotation_x(), message.fix_rotation_y(), message.fix_rotation_z()};
  support.axes = decode_own_axes(message, field);
  return support;
}

beams::PrescribedMotion decode_beam_motion(const proto::BeamMotion& message,
                                           const std::string& field) {
  beams::PrescribedMotion motion;
  motion.node = decode_index(message.node(), field + ".node");
  motion.translates = {message.has_x(), message.has_y(), message.has_z()};
  motion.translation = {message.x(), message.y(), message.z()};
  motion.axes = decode_own_axes(message, field);
  motion.rotates = {message.has_rotation_x(), message.has_rotation_y(), message.has_rotation_z()};
  motion.rotation = {message.rotation_x(), message.rotation_y(), message.rotation_z()};
  if (!message.has_rotation()) return motion;
  if (motion.rotates_any())
    throw invalid(field + ".rotation", "is in place of rotation_x, y and z, not beside them");
  motion.rotates = {true, true, true};
  motion.rotation = decode_vector(message.rotation());
  return motion;
}

beams::NodalLoad decode_nodal_load(const proto::BeamLoad& message, const std::string& field) {
  return {decode_index(message.node(), field + ".node"), decode_vector(message.force()),
          decode_vector(message.moment()), direction(message.follows())};
}

beams::DistributedLoad decode_distributed(const proto::BeamDistributedLoad& message,
                                          const std::string& field) {
  return {decode_index(message.element(), field + ".element"), decode_vector(message.force()),
          direction(message.follows())};
}

session::BeamConditions decode_beam_conditions(const proto::BeamStructure& message,
                                               const std::string& field) {
  session::BeamConditions read;
  decode_entries(message.supports(), field + ".supports", decode_support, read.supports);
  decode_entries(message.motions(), field + ".motions", decode_beam_motion, read.motions);
  decode_entries(message.loads(), field + ".loads", decode_nodal_load, read.loads);
  decode_entries(message.distributed_loads(), field + ".distributed_loads", decode_distributed,
                 read.distributed_loads);
  decode_entries(message.temporary_loads(), field + ".temporary_loads", decode_nodal_load,
                 read.temporary_loads);
  read.gravity = decode_vector(message.gravity());
  return read;
}

DecodedBeams decode_beam_structure(const proto::BeamStructure& message, const std::string& field) {
  DecodedBeams read = read_structure(message, field);
  with_fields_of(message, field + ".", [&] { validate(read.model); });
  return read;
}

DecodedBeams decode_beam_structure(const proto::BeamStructure& message,
                                   const scene::EdgeMesh& drawing, const std::string& field,
                                   const std::string& lines) {
  if (message.nodes_size() > 0 || message.elements_size() > 0)
    throw invalid(field + (message.nodes_size() > 0 ? ".nodes" : ".elements"),
                  "nodes and elements are those of lines, or given here, not both");
  DecodedBeams read = read_structure(message, field);
  add_drawing(drawing, read.model);
  const auto rename = [&](const std::string& name) {
    const bool drawn = name.starts_with("nodes") || name.starts_with("elements");
    return drawn ? lines : field + "." + name;
  };
  with_fields(rename, [&] { validate(read.model); });
  return read;
}

DecodedBeams decode_beam_job(const proto::MeshFile& message, const std::string& field) {
  try {
    const std::string settings = "DRMSettings.json";
    const auto& companions = message.companions();
    scene::BeamJobFiles files;
    files.job = scene::read_beam_job(
        message.content(), companions.contains(settings) ? std::string_view(companions.at(settings))
                                                         : std::string_view());
    const std::string mesh = std::filesystem::path(files.job.mesh_file).filename().string();
    files.mesh = scene::read_edge_mesh(mesh, companion(message, mesh, field));
    DecodedBeams read{
        files.job.label, session::model_of(files), {section_of(files.job)}, std::nullopt};
    validate(read.model);
    return read;
  } catch (const Error& error) {
    const std::string why = error.what();
    const bool named = error.field().empty() || why.starts_with(error.field());
    throw Error(error.code(), field, named ? why : error.field() + ": " + why);
  }
}

}  // namespace limber::server
