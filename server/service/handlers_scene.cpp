#include <fmt/format.h>

#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/scene/samples/samples.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "engine/session/beams/samples.h"
#include "server/kinds/beams/scenes.h"
#include "server/kinds/bodies/base_motions.h"
#include "server/kinds/bodies/scenes.h"
#include "server/kinds/bodies/tetrahedralization.h"
#include "server/kinds/linkages/scenes.h"
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

scene::TriangleSurface read_surface(const proto::MeshFile& file) {
  try {
    return scene::closed_outward(scene::read_surface(file.name(), file.content()));
  } catch (const Error& error) {
    throw Error(error.code(), "surface", error.what());
  }
}

std::vector<std::string> sample_names() {
  std::vector<std::string> names = scene::sample_names();
  for (const auto& name : scene::linkage_sample_names()) names.push_back(name);
  for (const auto& name : session::beam_sample_names()) names.push_back(name);
  return names;
}

proto::Scene named_sample(const std::string& name) {
  if (is_linkage_sample(name)) return linkage_sample_scene(name);
  if (is_beam_sample(name)) return beam_sample_scene(name);
  try {
    return sample_scene(name);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kNotFound) throw Error(error.code(), "name", error.what());
    throw Error(error.code(), "name",
                fmt::format("there is no sample '{}'; there are {}", name,
                            fmt::join(sample_names(), ", ")));
  }
}

}  // namespace

MeshLoader Service::mesh_loader() const {
  return [this](const proto::MeshSource& source, const std::string& field) {
    return meshes_.load(source, field);
  };
}

DecodedScene Service::decode(const proto::Scene& message) const {
  return decode_scene(message, "scene.", scene_limits(hub_.options.limits), mesh_loader(),
                      base_motion_reader());
}

MotionReader Service::base_motion_reader() const {
  return motion_reader([this](const std::string& path, const std::string& field) {
    return read_file_at(meshes_.resolve(path, field), field);
  });
}

proto::ValidateSceneResponse Service::validate_scene(
    const proto::ValidateSceneRequest& request) const {
  proto::ValidateSceneResponse response;
  if (request.scene().has_linkage()) {
    for (auto& issue : linkage_issues(request.scene(), "scene.", line_loader(),
                                      hub_.options.limits.session_bytes)) {
      *response.add_issues() = std::move(issue);
    }
    return response;
  }
  if (request.scene().has_beams()) {
    for (auto& issue :
         beam_issues(request.scene(), "scene.", edge_loader(), hub_.options.limits.session_bytes)) {
      *response.add_issues() = std::move(issue);
    }
    return response;
  }
  for (auto& issue : scene_issues(request.scene(), "scene.", scene_limits(hub_.options.limits),
                                  mesh_loader(), base_motion_reader())) {
    *response.add_issues() = std::move(issue);
  }
  return response;
}

proto::GetSampleResponse Service::get_sample(const proto::GetSampleRequest& request) const {
  proto::GetSampleResponse response;
  for (const auto& name : sample_names()) response.add_names(name);
  if (request.name().empty()) return response;
  *response.mutable_scene() = named_sample(request.name());
  return response;
}

proto::TetrahedralizeResponse Service::tetrahedralize(const proto::TetrahedralizeRequest& request) {
  scene::TetrahedralizeOptions options;
  if (request.has_target_tets()) {
    if (request.target_tets() > hub_.options.limits.mesh_tets) {
      throw limit_exceeded("target_tets", "tets", hub_.options.limits.mesh_tets,
                           request.target_tets());
    }
    options.target_tets = static_cast<int>(request.target_tets());
  }
  if (request.has_within()) options.within = request.within();
  options.validate();
  auto surface = read_surface(request.surface());
  proto::TetrahedralizeResponse response;
  response.set_job(start_job("tetrahedralize", "",
                             [options, surface = std::move(surface)](const JobContext& context) {
                               const auto result = scene::tetrahedralize(surface, options, context);
                               JobProduct product;
                               product.mesh = encode_mesh(result.mesh);
                               product.tetrahedralization = encode_report(result);
                               for (const auto& text : result.notes)
                                 product.issues.push_back(encode_warning("surface", text));
                               return product;
                             }));
  return response;
}

}  // namespace limber::server
