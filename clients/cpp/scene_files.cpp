#include "clients/cpp/scene_files.h"

#include <google/protobuf/util/json_util.h>

#include "clients/cpp/beams/files.h"
#include "clients/cpp/bodies/scene_files.h"
#include "clients/cpp/bodies/surface_files.h"
#include "clients/cpp/error.h"
#include "clients/cpp/linkages/scene_files.h"
#include "clients/cpp/scene_text.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

}  // namespace

fs::path file_of_scene(const fs::path& path) {
  return is_beam_job(path) ? file_of_beam_job(path) : path;
}

v1::Scene load_scene(const fs::path& path) {
  v1::Scene scene;
  if (is_beam_job(path)) {
    *scene.mutable_beams() = load_beams(path);
    return scene;
  }
  scene = parse_scene(read_bytes(path, "scene"), path);
  const fs::path folder = path.parent_path();
  put_mesh_bytes(scene, folder);
  put_linkage_bytes(scene, folder);
  put_beam_bytes(scene, folder);
  put_pose_bytes(scene, folder);
  put_surface_bytes(scene, folder);
  put_stiffness_bytes(scene, folder);
  return scene;
}

fs::path save_scene(v1::Scene scene, const std::string& name, const fs::path& folder) {
  save_mesh(scene, name, folder);
  save_surface(scene, folder);
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(scene, &text, options);
  if (!status.ok())
    throw ClientError(v1::ERROR_CODE_INTERNAL, "scene", std::string(status.message()));
  const fs::path path = folder / (name + ".json");
  write_bytes(path, text);
  return path;
}

}  // namespace limber::client
