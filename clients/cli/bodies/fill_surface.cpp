#include "clients/cli/bodies/fill_surface.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <utility>

#include "clients/cli/jobs.h"
#include "clients/cli/print.h"
#include "clients/cpp/bodies/plain_files.h"
#include "clients/cpp/bodies/surface_files.h"
#include "clients/cpp/files.h"
#include "clients/cpp/scene_files.h"
#include "clients/cpp/server.h"

namespace limber::cli::bodies {
namespace {

using client::ClientError;

/// A .ply of lines in the folder of its job is no surface.
ClientError with_hint_at_job(const ClientError& error, const std::filesystem::path& file) {
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  if (client::file_of_scene(folder) == folder) return error;
  return {error.code(), error.field(),
          fmt::format("{}; {} is a job of the public relaxation code: open the folder",
                      error.what(), folder.string()),
          error.details()};
}

/// @returns the job's mesh and report
v1::GetJobResponse tets_within(Context& context, const std::string& surface, const Filling& filling,
                               double wait_s) {
  v1::TetrahedralizeRequest request;
  *request.mutable_surface() = client::mesh_file(surface, "scene");
  if (filling.tets) request.set_target_tets(*filling.tets);
  if (filling.within) request.set_within(*filling.within);
  const std::uint64_t job = client::start_job(context.client(), request);
  try {
    return follow_job(context, job, wait_s);
  } catch (const ClientError&) {
    if (interrupted()) cancel_quietly(context, job);
    throw;
  }
}

/// Names the option that was typed in place of the field of the request that it fills.
ClientError with_option(const ClientError& error) {
  constexpr const char* kField = "target_tets";
  std::string message = error.what();
  if (message.starts_with(kField)) message.replace(0, std::strlen(kField), "--tets");
  return {error.code(), "--tets", message, error.details()};
}

/// As `limber tetrahedralize` says it.
void print_distance(const v1::TetrahedralizationReport& report) {
  fmt::print(stderr,
             "note: {} tets fill the surface; distance: surface to mesh {:.3g}, mesh to surface "
             "{:.3g}: {:.2g} % of the body's length\n",
             report.tets(), report.surface_to_mesh(), report.mesh_to_surface(),
             100 * report.distance_share());
}

}  // namespace

v1::Scene fill_surface(Context& context, const std::string& surface, const Filling& filling,
                       double wait_s) {
  try {
    v1::GetJobResponse filled = tets_within(context, surface, filling, wait_s);
    for (const auto& issue : filled.issues()) fmt::print(stderr, "{}\n", describe(issue));
    print_distance(filled.tetrahedralization());
    v1::Scene scene = client::scene_of_tets(std::filesystem::path(surface).stem().string(),
                                            std::move(*filled.mutable_mesh()));
    *scene.mutable_surface()->mutable_file() = client::surface_file(surface, "scene");
    return scene;
  } catch (const client::Unreachable&) {
    throw;
  } catch (const ClientError& error) {
    if (error.field() == "target_tets") throw with_option(error);
    if (error.code() != v1::ERROR_CODE_INVALID_ARGUMENT) throw;
    throw with_hint_at_job(error, surface);
  }
}

}  // namespace limber::cli::bodies
