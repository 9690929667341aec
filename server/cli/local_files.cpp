#include "server/cli/local_files.h"

#include <fstream>

#include "engine/base/error.h"
#include "engine/scene/formats/beam_job.h"
#include "engine/scene/formats/mesh_formats.h"

namespace limber::server {

namespace fs = std::filesystem;

namespace {

constexpr const char* kJob = "SimulationJob.json";
constexpr const char* kSettings = "DRMSettings.json";

}  // namespace

PathResolver paths_beside(const fs::path& scene_file) {
  return [folder = scene_file.parent_path()](const std::string& path, const std::string&) {
    return folder / path;
  };
}

bool is_local_beam_job(const fs::path& path) {
  std::error_code ignored;
  return path.filename() == kJob || fs::is_directory(path, ignored);
}

proto::Scene local_beam_job(const fs::path& path) {
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

void write_file(const fs::path& path, const std::string& content, WriteMode mode) {
  std::ofstream out(
      path, std::ios::binary | (mode == WriteMode::kAppend ? std::ios::app : std::ios::trunc));
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  if (!out.flush()) throw Error(ErrorCode::kIo, path.string(), "cannot be written");
}

}  // namespace limber::server
