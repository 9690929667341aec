#include "clients/cpp/beams/files.h"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "clients/cpp/error.h"
#include "clients/cpp/files.h"
#include "clients/cpp/scene_text.h"
#include "proto/json_text.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJob = "SimulationJob.json";
constexpr const char* kSettings = "DRMSettings.json";
constexpr const char* kJobKeys[] = {"mesh filename", "cross section dim", "beam material"};

google::protobuf::Struct document_of(const std::string& content) {
  google::protobuf::Struct document;
  if (!google::protobuf::util::JsonStringToMessage(content, &document).ok()) return {};
  return document;
}

/// Any of these keys identifies a job: one of them may be misspelt.
bool is_job_document(const google::protobuf::Struct& document) {
  return std::any_of(std::begin(kJobKeys), std::end(kJobKeys),
                     [&](const char* key) { return document.fields().contains(key); });
}

/// Name of the mesh file; empty where the job has none, which the server refuses.
std::string mesh_of_job(const google::protobuf::Struct& document) {
  const auto found = document.fields().find("mesh filename");
  if (found == document.fields().end()) return {};
  return fs::path(found->second.string_value()).filename().string();
}

void read_job(const fs::path& path, const std::string& content, const std::string& mesh,
              v1::MeshFile& job) {
  job.set_name(path.filename().string());
  job.set_content(content);
  auto& companions = *job.mutable_companions();
  if (!mesh.empty()) companions[mesh] = read_bytes(path.parent_path() / mesh, "job");
  std::error_code ignored;
  if (fs::is_regular_file(path.parent_path() / kSettings, ignored))
    companions[kSettings] = read_bytes(path.parent_path() / kSettings, "job");
}

}  // namespace

bool is_beam_job(const fs::path& path) {
  std::error_code ignored;
  return path.filename() == kJob || fs::is_regular_file(path / kJob, ignored);
}

fs::path file_of_beam_job(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored) ? path / kJob : path;
}

v1::BeamScene load_beams(const fs::path& given) {
  const fs::path path = file_of_beam_job(given);
  std::string content = read_bytes(path, "structure");
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);  // a byte order mark
  v1::BeamScene scene;
  const google::protobuf::Struct document = document_of(content);
  if (path.filename() == kJob || is_job_document(document)) {
    read_job(path, content, mesh_of_job(document), *scene.mutable_job());
    return scene;
  }
  if (document.fields().contains("beams")) {
    v1::Scene whole = parse_scene(content, path);
    put_beam_bytes(whole, path.parent_path());
    return std::move(*whole.mutable_beams());
  }
  if (const auto fault = json::read_message(content, *scene.mutable_structure()))
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT,
                      fault->field.empty() ? "structure" : "structure." + fault->field,
                      path.string() + ": " + fault->message);
  return scene;
}

void put_beam_bytes(v1::Scene& scene, const fs::path& folder) {
  if (!scene.beams().lines().has_path()) return;
  auto& lines = *scene.mutable_beams()->mutable_lines();
  *lines.mutable_file() = mesh_file(folder / lines.path(), "beams.lines.path");
}

}  // namespace limber::client
