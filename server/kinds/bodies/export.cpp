#include "server/kinds/bodies/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "engine/scene/formats/mesh_writers.h"
#include "engine/scene/formats/point_cache.h"
#include "engine/scene/formats/surface_formats.h"
#include "engine/session/bodies/geometry.h"
#include "server/kinds/bodies/keyframe.h"
#include "server/kinds/bodies/scene.h"
#include "server/runtime/export_parts.h"
#include "server/wire/errors.h"
#include "server/wire/file_stem.h"
#include "server/wire/indices.h"
#include "server/wire/precise_frames.h"
#include "server/wire/scene_json.h"

namespace limber::server {
namespace {

constexpr std::size_t kPc2Header = 32,
                      kPc2SampleCount = 28;  // bytes; offset of the number of samples

bool is_obj(const std::string& name) { return scene::surface_ending(name) == ".obj"; }

/// Nodes of the surface, ascending.
std::vector<int> surface_nodes(const session::Geometry& geometry) {
  std::vector<int> nodes(geometry.surface.data(),
                         geometry.surface.data() + geometry.surface.size());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

/// @param positions  3 points x samples
Eigen::MatrixXf relative_to(const Eigen::Vector3d& origin, const Eigen::MatrixXd& positions) {
  const Eigen::VectorXd shift = origin.replicate(positions.rows() / 3, 1);
  return (positions.colwise() - shift).cast<float>();
}

std::string obj_at(const Eigen::Vector3d& origin, const Eigen::Matrix3Xd& vertices,
                   const Eigen::Matrix3Xi& triangles) {
  if (origin.isZero(0)) return scene::write_obj(vertices, triangles);
  return fmt::format("# relative to {} {} {}\n", origin.x(), origin.y(), origin.z()) +
         scene::write_obj(vertices.colwise() - origin, triangles);
}

/// What a job leaves behind.
class ComputedFiles final : public JobMotion {
 public:
  explicit ComputedFiles(std::shared_ptr<const ComputedMotion> motion)
      : motion_(std::move(motion)) {}

  [[nodiscard]] int frame_count() const override {
    return static_cast<int>(motion_->positions.cols());
  }
  [[nodiscard]] std::uint64_t bytes(int count) const override {
    return static_cast<std::uint64_t>(motion_->positions.rows()) * bytes_of(precision()) *
           static_cast<std::uint64_t>(count);
  }
  [[nodiscard]] proto::Frames encode(FrameRange range) const override {
    proto::Frames frames;
    frames.set_encoding(proto::ENCODING_POSITIONS);
    frames.set_first_frame(static_cast<std::uint32_t>(range.first));
    frames.set_frame_count(static_cast<std::uint32_t>(range.count));
    set_positions(motion_->positions.middleCols(range.first, range.count), precision(),
                  proto::ENCODING_POSITIONS, frames);
    return frames;
  }
  [[nodiscard]] proto::ExportResponse export_part(
      const proto::ExportRequest& request) const override {
    demand_body_format(request.format());
    return export_computed(motion_, request.format(), decode_file_stem(request.stem(), "motion"),
                           request.part());
  }

 private:
  [[nodiscard]] scene::Precision precision() const {
    return scene::precision_for(motion_->geometry.rest);
  }

  std::shared_ptr<const ComputedMotion> motion_;
};

}  // namespace

void demand_body_format(proto::ExportFormat format) {
  switch (format) {
    case proto::EXPORT_FORMAT_PVD:
    case proto::EXPORT_FORMAT_PC2:
    case proto::EXPORT_FORMAT_BLENDER:
    case proto::EXPORT_FORMAT_SCENE:
    case proto::EXPORT_FORMAT_SURFACE:
      return;
    case proto::EXPORT_FORMAT_UNSPECIFIED:
      throw invalid("format", "unspecified");
    default:
      throw invalid("format", "an elastic body is exported as PVD, PC2, BLENDER, SURFACE or SCENE");
  }
}

int MotionExport::frames_per_part(proto::ExportFormat format) const {
  const auto nodes = static_cast<std::uint64_t>(geometry->rest.cols());
  const auto tets = static_cast<std::uint64_t>(geometry->tets.cols());
  const std::uint64_t per_frame = format == proto::EXPORT_FORMAT_PVD ? 24 * nodes + 40 * tets + 2000
                                  : format == proto::EXPORT_FORMAT_SURFACE && surface
                                      ? 12 * static_cast<std::uint64_t>(surface->vertex_count())
                                      : 12 * nodes;
  return static_cast<int>(
      std::clamp<std::uint64_t>(kPartBytes / std::max<std::uint64_t>(1, per_frame), 1, 1u << 20));
}

std::uint32_t MotionExport::part_count(proto::ExportFormat format) const {
  const int step = frames_per_part(format);
  return static_cast<std::uint32_t>((frame_count + step - 1) / step);
}

proto::ExportResponse MotionExport::part(proto::ExportFormat format, std::uint32_t part) const {
  const std::uint32_t parts = part_count(format);
  if (part >= parts) {
    throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "part",
                  fmt::format("part {} of {}", part, parts));
  }
  const int step = frames_per_part(format), first = decode_index(part, "part") * step;
  const int count = std::min(step, frame_count - first);
  proto::ExportResponse response;
  response.set_part(part);
  response.set_part_count(parts);
  if (format == proto::EXPORT_FORMAT_PC2) {
    add_pc2(first, count, response);
  } else if (format == proto::EXPORT_FORMAT_BLENDER) {
    add_surface(first, count, response);
  } else if (format == proto::EXPORT_FORMAT_SURFACE) {
    add_detail(first, count, response);
  } else {
    add_pvd(first, count, response);
  }
  return response;
}

void MotionExport::add_pvd(int first, int count, proto::ExportResponse& response) const {
  const auto name = [&](int frame) { return fmt::format("{}_{:05}.vtu", stem, frame); };
  if (first == 0) {
    std::vector<std::string> files;
    std::vector<double> times;
    for (int frame = 0; frame < frame_count; ++frame) {
      files.push_back(name(frame));
      times.push_back(frame / frames_per_second);
    }
    add_file(response, stem + ".pvd", scene::write_pvd(files, times));
  }
  bodies::TetMesh mesh;
  mesh.nodes = geometry->rest;
  mesh.tets = geometry->tets;
  const Eigen::Map<const Eigen::VectorXd> rest(geometry->rest.data(), geometry->rest.size());
  const Eigen::MatrixXd moved = positions(first, count);
  for (int i = 0; i < count; ++i) {
    add_file(response, name(first + i),
             scene::write_vtu_frame(mesh, moved.col(i) - rest, scene::precision_for(mesh.nodes)));
  }
}

void MotionExport::add_pc2(int first, int count, proto::ExportResponse& response) const {
  if (first == 0)
    add_file(response, stem + ".obj", obj_at(origin(), geometry->rest, geometry->surface));
  add_cache(stem + ".pc2", positions(first, count), first, response);
}

void MotionExport::add_surface(int first, int count, proto::ExportResponse& response) const {
  const std::vector<int> nodes = surface_nodes(*geometry);
  const std::string name = stem + "_surface";
  if (first == 0) {
    std::vector<int> vertex(static_cast<std::size_t>(geometry->rest.cols()), -1);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      vertex[static_cast<std::size_t>(nodes[k])] = static_cast<int>(k);
    Eigen::Matrix3Xi triangles = geometry->surface;
    for (int& node : triangles.reshaped()) node = vertex[static_cast<std::size_t>(node)];
    add_file(response, name + ".obj",
             obj_at(origin(), geometry->rest(Eigen::all, nodes), triangles));
  }
  const Eigen::MatrixXd moved = positions(first, count);
  Eigen::MatrixXd own(static_cast<Eigen::Index>(3 * nodes.size()), count);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    own.middleRows<3>(static_cast<Eigen::Index>(3 * k)) =
        moved.middleRows<3>(Eigen::Index{3} * nodes[k]);
  add_cache(name + ".pc2", own, first, response);
}

void MotionExport::add_detail(int first, int count, proto::ExportResponse& response) const {
  const scene::DetailedSurface& detailed = *surface->detailed;
  const std::string name = stem + "_detail";
  if (first == 0) {
    add_file(response, name + ".obj",
             is_obj(detailed.name) && origin().isZero(0)
                 ? detailed.content
                 : obj_at(origin(), detailed.surface.vertices, detailed.surface.triangles));
    for (const auto& [companion, content] : detailed.companions)
      add_file(response, companion, content);
  }
  add_cache(name + ".pc2", scene::embedded_positions(surface->embedding, positions(first, count)),
            first, response);
}

Eigen::Vector3d MotionExport::origin() const { return scene::origin_for(geometry->rest); }

/// The header says how many samples there are in all; parts after the first are bytes to append.
void MotionExport::add_cache(const std::string& name, const Eigen::MatrixXd& samples, int first,
                             proto::ExportResponse& response) const {
  scene::PointCache cache;
  cache.positions = relative_to(origin(), samples);
  std::string bytes = scene::write_pc2(cache);
  if (first == 0) {
    const std::int32_t count = frame_count;
    std::memcpy(bytes.data() + kPc2SampleCount, &count, sizeof count);
    add_file(response, name, std::move(bytes));
  } else {
    add_file(response, name, bytes.substr(kPc2Header), true);
  }
}

namespace {
/// The file as it was given, under a name that no other export of this stem has.
void add_surface_of(const scene::DetailedSurface& surface, const std::string& stem,
                    proto::Scene& message, proto::ExportResponse& response) {
  const std::string name = stem + "_surface_given" + scene::surface_ending(surface.name);
  message.mutable_surface()->set_path(name);
  add_file(response, name, surface.content);
  for (const auto& [companion, content] : surface.companions)
    add_file(response, companion, content);
}
}  // namespace

proto::ExportResponse export_scene(const scene::Scene& scene, const std::string& stem) {
  proto::Scene message = encode_scene(scene);
  encode_poses(scene, message);
  message.mutable_mesh()->set_path(stem + ".vtu");
  // No name that the export of a motion under the same stem has.
  const std::string base = stem + "_base.pc2";
  const bool has_base = scene.base_motion.size() > 0;
  if (has_base) message.mutable_base_motion()->set_path(base);
  proto::ExportResponse response;
  response.set_part_count(1);
  if (scene.surface) add_surface_of(*scene.surface, stem, message, response);
  add_file(response, stem + ".json", scene_to_json(message));
  add_file(response, stem + ".vtu", scene::write_vtu(scene.mesh));
  if (has_base) {
    scene::PointCache cache;
    const Eigen::Map<const Eigen::VectorXd> rest(scene.mesh.nodes.data(), scene.mesh.nodes.size());
    cache.positions =
        relative_to(scene::origin_for(scene.mesh.nodes), scene.base_motion.colwise() + rest);
    add_file(response, base, scene::write_pc2(cache));
  }
  return response;
}

std::shared_ptr<const JobMotion> job_motion(ComputedMotion motion) {
  return std::make_shared<ComputedFiles>(std::make_shared<const ComputedMotion>(std::move(motion)));
}

proto::ExportResponse export_computed(const std::shared_ptr<const ComputedMotion>& motion,
                                      proto::ExportFormat format, const std::string& stem,
                                      std::uint32_t part) {
  if (format == proto::EXPORT_FORMAT_SCENE) {
    if (part > 0) throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "part", "a scene has one part");
    return export_scene(session::with_base_motion(motion->scene, motion->positions), stem);
  }
  MotionExport files;
  files.geometry = {motion, &motion->geometry};
  files.frame_count = static_cast<int>(motion->positions.cols());
  files.positions = [&](int first, int count) -> Eigen::MatrixXd {
    return motion->positions.middleCols(first, count);
  };
  files.stem = stem;
  files.frames_per_second = motion->frames_per_second;
  return files.part(format, part);
}

}  // namespace limber::server
