#include "engine/scene/formats/mesh_formats.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "engine/scene/formats/material_files.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene {
namespace {

namespace fs = std::filesystem;
using formats::TextCursor;

std::string ending_of(const std::string& name) {
  return formats::to_lower(fs::path(name).extension().string());
}

bool begins_with(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

/// Opened for reading without waiting for anybody, as a pipe without a writer would.
class RegularFile {
 public:
  enum class Kind { kRegular, kFolder, kOther, kNone };
  explicit RegularFile(const fs::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    struct stat status {};
    if (file_ < 0 || ::fstat(file_, &status) != 0) return;
    kind_ = S_ISREG(status.st_mode)   ? Kind::kRegular
            : S_ISDIR(status.st_mode) ? Kind::kFolder
                                      : Kind::kOther;
  }
  ~RegularFile() {
    if (file_ >= 0) ::close(file_);
  }
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;
  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] int descriptor() const { return file_; }

 private:
  int file_;
  Kind kind_ = Kind::kNone;
};

/// The companion with this ending and, if there are several, the stem of the main file.
const std::pair<const std::string, std::string>* companion_with_ending(const MeshFileSet& files,
                                                                       const std::string& ending) {
  const std::pair<const std::string, std::string>* found = nullptr;
  for (const auto& companion : files.companions) {
    if (ending_of(companion.first) != ending) continue;
    if (found == nullptr || fs::path(companion.first).stem() == fs::path(files.name).stem())
      found = &companion;
  }
  return found;
}

MeshReading read_tetgen_pair(const MeshFileSet& files) {
  const bool nodes_given = ending_of(files.name) == ".node";
  const auto* const other = companion_with_ending(files, nodes_given ? ".ele" : ".node");
  if (other == nullptr) {
    throw Error(ErrorCode::kNotFound, files.name,
                files.name + ": TetGen meshes are two files; the " +
                    (nodes_given ? ".ele" : ".node") + " file is missing");
  }
  TextCursor first(files.name, files.content);
  TextCursor second(other->first, other->second);
  return nodes_given ? formats::read_tetgen(first, second) : formats::read_tetgen(second, first);
}

MeshReading read_by_ending(const MeshFileSet& files, std::string_view content,
                           const MeshReadLimits& limits) {
  const std::string ending = ending_of(files.name);
  TextCursor file(files.name, content);
  if (ending == ".node" || ending == ".ele") return read_tetgen_pair(files);
  if (ending == ".inp" || ending == ".abq") return formats::read_abaqus(file);
  if (ending == ".veg") return formats::read_vega(file, files.companions);
  if (ending == ".mesh") return formats::read_medit(file);
  if (ending == ".msh") {
    throw Error(ErrorCode::kInvalidArgument, files.name,
                files.name + ":1: a .msh file begins with '$MeshFormat' or '$NOD'");
  }
  if (ending == ".vtk") return formats::read_vtk_legacy(file);
  if (ending == ".vtu") return formats::read_vtu(files.name, content, limits.array_bytes);
  if (begins_with(formats::to_lower(formats::trim(content.substr(0, 200))), "*node"))
    return formats::read_abaqus(file);
  throw Error(ErrorCode::kUnsupported, files.name,
              files.name +
                  ": the format is not recognised; read are .msh, .mesh, .node/.ele, .vtk, .vtu, "
                  ".inp, .abq "
                  "and .veg");
}

MeshReading read_by_content(const MeshFileSet& files, const MeshReadLimits& limits) {
  std::string_view content = files.content;
  if (begins_with(content, "\xEF\xBB\xBF")) content.remove_prefix(3);
  const std::string_view start = formats::trim(content.substr(0, 200));
  TextCursor file(files.name, content);
  if (start.empty() && formats::trim(content).empty()) file.fail("the file is empty");
  if (begins_with(start, "$MeshFormat")) return formats::read_gmsh(file);
  if (begins_with(start, "$NOD")) return formats::read_gmsh_1(file);
  if (begins_with(start, "# vtk DataFile")) return formats::read_vtk_legacy(file);
  if (begins_with(start, "<?xml") || begins_with(start, "<VTKFile")) {
    return formats::read_vtu(files.name, content, limits.array_bytes);
  }
  if (begins_with(start, "MeshVersionFormatted")) return formats::read_medit(file);
  return read_by_ending(files, content, limits);
}

}  // namespace

MeshReading read_mesh(const MeshFileSet& files, const MeshReadLimits& limits) {
  MeshReading reading = read_by_content(files, limits);
  if (const auto* const materials = companion_with_ending(files, ".elastic")) {
    read_materials(materials->first, materials->second, reading);
    reading.warnings.push_back("materials are taken from " + materials->first);
  }
  return reading;
}

std::string read_bytes(const fs::path& path, std::size_t max_bytes) {
  const auto refuse = [&](ErrorCode code, const std::string& why) {
    throw Error(code, path.string(), path.string() + ": " + why);
  };
  const RegularFile file(path);
  if (file.kind() == RegularFile::Kind::kNone) refuse(ErrorCode::kIo, "cannot be opened");
  if (file.kind() == RegularFile::Kind::kFolder) refuse(ErrorCode::kIo, "is a folder, not a file");
  if (file.kind() == RegularFile::Kind::kOther)
    refuse(ErrorCode::kIo, "is a pipe, a socket or a device, not a regular file");
  std::string bytes;
  constexpr std::size_t kChunk = std::size_t{1} << 20;
  while (true) {
    const std::size_t size = bytes.size();
    bytes.resize(size + kChunk);
    const auto count = ::read(file.descriptor(), bytes.data() + size, kChunk);
    bytes.resize(size + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return bytes;
    if (count < 0 && errno != EINTR) refuse(ErrorCode::kIo, "cannot be read");
    if (bytes.size() > max_bytes)
      refuse(ErrorCode::kLimitExceeded, "has more than " + std::to_string(max_bytes) + " bytes");
  }
}

MeshReading read_mesh_file(const fs::path& path, std::size_t max_bytes,
                           const MeshReadLimits& limits) {
  MeshFileSet files;
  files.name = path.filename().string();
  files.content = read_bytes(path, max_bytes);
  const auto take = [&](const fs::path& companion) {
    std::error_code status;
    if (fs::is_regular_file(companion, status)) {
      files.companions[companion.filename().string()] = read_bytes(companion, max_bytes);
    }
  };
  const std::string ending = ending_of(files.name);
  if (ending == ".node") take(fs::path(path).replace_extension(".ele"));
  if (ending == ".ele") take(fs::path(path).replace_extension(".node"));
  if (ending == ".veg") {
    for (const std::string& name : formats::vega_includes(files.content)) {
      take(path.parent_path() / name);
    }
  }
  take(fs::path(path).replace_extension(".elastic"));
  return read_mesh(files, limits);
}

}  // namespace limber::scene
