#include "clients/cpp/scene_files.h"
#include "clients/cpp/beam_files.h"

#include <fcntl.h>
#include <google/protobuf/util/json_util.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <system_error>
#include <vector>

#include "clients/cpp/error.h"
#include "clients/cpp/motion_files.h"
#include "proto/json_text.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Names in `*INCLUDE NAME` lines of a VegaFEM file.
std::vector<std::string> vega_includes(const std::string& content) {
  std::vector<std::string> names;
  std::istringstream lines(content);
  for (std::string line; std::getline(lines, line);) {
    const std::string key = "*include";
    if (lower(line.substr(0, key.size())) != key) continue;
    const auto start = line.find_first_not_of(" \t", key.size());
    const auto end = line.find_last_not_of(" \t\r");
    if (start != std::string::npos && start > key.size())
      names.push_back(line.substr(start, end - start + 1));
  }
  return names;
}

template <class Number>
std::vector<Number> numbers(const v1::Array& array) {
  std::vector<Number> values(array.data().size() / sizeof(Number));
  if (!values.empty())
    std::memcpy(values.data(), array.data().data(), values.size() * sizeof(Number));
  return values;
}

/// Gmsh MSH 2.2, ASCII: every tool reads it.
std::string msh(const v1::MeshArrays& mesh) {
  std::vector<double> nodes;
  if (mesh.nodes().type() == v1::DATA_TYPE_FLOAT32) {
    const auto floats = numbers<float>(mesh.nodes());
    nodes.assign(floats.begin(), floats.end());
  } else {
    nodes = numbers<double>(mesh.nodes());
  }
  const auto tets = numbers<std::int32_t>(mesh.tets());
  std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes.size() / 3) + "\n";
  char digits[32];
  for (std::size_t i = 0; i + 2 < nodes.size(); i += 3) {
    text += std::to_string(i / 3 + 1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto end = std::to_chars(digits, digits + sizeof digits, nodes[i + axis]).ptr;
      text.append(1, ' ').append(digits, end);
    }
    text += '\n';
  }
  text += "$EndNodes\n$Elements\n" + std::to_string(tets.size() / 4) + "\n";
  for (std::size_t i = 0; i + 3 < tets.size(); i += 4) {
    text += std::to_string(i / 4 + 1) + " 4 0";
    for (std::size_t corner = 0; corner < 4; ++corner)
      text.append(1, ' ').append(std::to_string(tets[i + corner] + 1));
    text += '\n';
  }
  return text + "$EndElements\n";
}

/// A relative path that stays below where it starts.
bool stays_below(const fs::path& path) {
  return !path.empty() && path.is_relative() &&
         std::find(path.begin(), path.end(), "..") == path.end();
}

}  // namespace

std::string read_bytes(const fs::path& path, const std::string& field) {
  const auto refuse = [&](const char* why) {
    throw ClientError(v1::ERROR_CODE_IO, field, "cannot read " + path.string() + why);
  };
  // A pipe without a writer is not waited for.
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) refuse((": " + std::system_category().message(errno)).c_str());
  const std::unique_ptr<const int, void (*)(const int*)> closed(&file,
                                                                [](const int* f) { ::close(*f); });
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) refuse(": it is no regular file");
  std::string bytes;
  constexpr std::size_t kChunk = std::size_t{1} << 20;
  while (true) {
    const std::size_t size = bytes.size();
    bytes.resize(size + kChunk);
    const auto count = ::read(file, bytes.data() + size, kChunk);
    bytes.resize(size + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return bytes;
    if (count < 0 && errno != EINTR) refuse((": " + std::system_category().message(errno)).c_str());
  }
}

void write_bytes(const fs::path& path, const std::string& bytes, WriteMode mode) {
  std::error_code ignored;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), ignored);
  std::ofstream out(
      path, std::ios::binary | (mode == WriteMode::kAppend ? std::ios::app : std::ios::trunc));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw ClientError(v1::ERROR_CODE_IO, "out", "cannot write " + path.string());
}

v1::MeshFile mesh_file(const fs::path& path, const std::string& field) {
  v1::MeshFile file;
  file.set_name(path.filename().string());
  file.set_content(read_bytes(path, field));
  std::vector<fs::path> beside;
  const std::string ending = lower(path.extension().string());
  const auto with_ending = [&](const char* other) {
    return fs::path(path).replace_extension(other);
  };
  if (ending == ".ele") beside.push_back(with_ending(".node"));
  if (ending == ".node") beside.push_back(with_ending(".ele"));
  if (ending == ".veg")
    for (const auto& name : vega_includes(file.content()))
      beside.push_back(path.parent_path() / name);
  std::error_code ignored;
  if (ending != ".elastic" && fs::is_regular_file(with_ending(".elastic"), ignored))
    beside.push_back(with_ending(".elastic"));
  for (const auto& companion : beside)
    (*file.mutable_companions())[companion.filename().string()] =
        read_bytes(companion, field == "mesh.path" ? "mesh.companions" : field);
  return file;
}

v1::Scene load_scene(const fs::path& path) {
  v1::Scene scene;
  if (is_beam_job(path)) {
    *scene.mutable_beams() = load_beams(path);
    return scene;
  }
  if (const auto fault = json::read_scene(read_bytes(path, "scene"), scene))
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT,
                      fault->field.empty() ? "scene" : "scene." + fault->field,
                      path.string() + " is no scene: " + fault->message);
  if (scene.mesh().has_path()) {
    const fs::path mesh = path.parent_path() / scene.mesh().path();
    *scene.mutable_mesh()->mutable_file() = mesh_file(mesh);
  }
  if (scene.linkage().lines().has_path()) {
    auto& lines = *scene.mutable_linkage()->mutable_lines();
    *lines.mutable_file() = mesh_file(path.parent_path() / lines.path(), "linkage.lines.path");
  }
  if (scene.beams().lines().has_path()) {
    auto& lines = *scene.mutable_beams()->mutable_lines();
    *lines.mutable_file() = mesh_file(path.parent_path() / lines.path(), "beams.lines.path");
  }
  for (int i = 0; i < scene.keyframes_size(); ++i) {
    auto& keyframe = *scene.mutable_keyframes(i);
    if (!keyframe.has_path()) continue;
    const fs::path pose = path.parent_path() / keyframe.path();
    *keyframe.mutable_file() = mesh_file(pose, "keyframes[" + std::to_string(i) + "].path");
  }
  if (scene.has_base_motion()) put_motion_bytes(*scene.mutable_base_motion(), path.parent_path());
  return scene;
}

fs::path save_scene(v1::Scene scene, const std::string& name, const fs::path& folder) {
  if (scene.mesh().has_file()) {
    const v1::MeshFile file = scene.mesh().file();
    for (const auto& [companion, content] : file.companions())
      write_bytes(folder / fs::path(companion).filename(), content);
    const std::string mesh_name = fs::path(file.name()).filename().string();
    write_bytes(folder / mesh_name, file.content());
    scene.mutable_mesh()->set_path(mesh_name);
  } else if (scene.mesh().has_arrays()) {
    write_bytes(folder / (name + ".msh"), msh(scene.mesh().arrays()));
    scene.mutable_mesh()->set_path(name + ".msh");
  }
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

fs::path write_exported(const fs::path& folder, const v1::ExportedFile& file) {
  const fs::path name = file.name();
  if (!stays_below(name) || !name.has_filename())
    throw ClientError(v1::ERROR_CODE_MALFORMED, "files.name",
                      "the server names a file outside the folder: '" + file.name() + "'");
  write_bytes(folder / name, file.content(),
              file.append() ? WriteMode::kAppend : WriteMode::kReplace);
  return folder / name;
}

}  // namespace limber::client
