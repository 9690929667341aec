#include <fmt/format.h>

#include <boost/asio/post.hpp>

#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/samples/samples.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "server/codec/errors.h"
#include "server/service/base_motions.h"
#include "server/service/scene_files.h"
#include "server/service/service.h"

namespace limber::server {
namespace {

scene::TriangleSurface read_surface(const proto::MeshFile& file) {
  try {
    return scene::closed_outward(scene::read_surface(file.name(), file.content()));
  } catch (const Error& error) {
    throw Error(error.code(), "surface", error.what());
  }
}

proto::Scene named_sample(const std::string& name) {
  try {
    return sample_scene(name);
  } catch (const Error& error) {
    throw Error(error.code(), "name", error.what());
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
  for (auto& issue : scene_issues(request.scene(), "scene.", scene_limits(hub_.options.limits),
                                  mesh_loader(), base_motion_reader())) {
    *response.add_issues() = std::move(issue);
  }
  return response;
}

proto::GetSampleResponse Service::get_sample(const proto::GetSampleRequest& request) const {
  proto::GetSampleResponse response;
  for (const auto& name : scene::sample_names()) response.add_names(name);
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
  options.validate();
  auto surface = read_surface(request.surface());
  const Cancellation cancellation;
  const JobId job =
      hub_.jobs.start("tetrahedralize", "", [cancellation] { cancellation.request(); });
  boost::asio::post(hub_.session_pool,
                    [this, job, cancellation, options, surface = std::move(surface)] {
                      run_tetrahedralize(job,
                                         {cancellation,
                                          [this, job](const std::string& stage, double fraction) {
                                            hub_.jobs.progress(job, {stage, fraction});
                                          }},
                                         surface, options);
                    });
  proto::TetrahedralizeResponse response;
  response.set_job(job);
  return response;
}

void Service::run_tetrahedralize(JobId job, const JobContext& context,
                                 const scene::TriangleSurface& surface,
                                 const scene::TetrahedralizeOptions& options) {
  try {
    const auto result = scene::tetrahedralize(surface, options, context);
    JobProduct product;
    product.mesh = encode_mesh(result.mesh);
    for (const auto& text : result.notes) product.issues.push_back(encode_warning("surface", text));
    hub_.jobs.done(job, std::move(product));
  } catch (const std::exception& fault) {
    const auto* error = dynamic_cast<const Error*>(&fault);
    if (error != nullptr && error->code() == ErrorCode::kCancelled) return hub_.jobs.cancelled(job);
    hub_.jobs.failed(job, error_to_proto(fault));
  }
}

}  // namespace limber::server
