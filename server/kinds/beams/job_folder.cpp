#include "server/kinds/beams/job_folder.h"

#include "engine/scene/formats/beam_job.h"
#include "engine/scene/formats/mesh_formats.h"

namespace limber::server {

namespace fs = std::filesystem;

namespace {

constexpr const char* kJob = "SimulationJob.json";
constexpr const char* kSettings = "DRMSettings.json";

}  // namespace

bool is_beam_job_folder(const fs::path& path) {
  std::error_code ignored;
  return path.filename() == kJob || fs::is_directory(path, ignored);
}

proto::Scene beam_job_scene(const fs::path& path) {
  std::error_code ignored;
  const fs::path file = fs::is_directory(path, ignored) ? path / kJob : path;
  proto::Scene scene;
  proto::MeshFile& job = *scene.mutable_beams()->mutable_job();
  job.set_name(kJob);
  job.set_content(scene::read_bytes(file));
  auto& companions = *job.mutable_companions();
  // The name alone: jobs do not reach out of their folder.
  const fs::path mesh = fs::path(scene::read_beam_job(job.content()).mesh_file).filename();
  companions[mesh.string()] = scene::read_bytes(file.parent_path() / mesh);
  const fs::path settings = file.parent_path() / kSettings;
  if (fs::is_regular_file(settings, ignored)) companions[kSettings] = scene::read_bytes(settings);
  return scene;
}

}  // namespace limber::server
