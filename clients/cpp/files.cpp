#include "clients/cpp/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <fstream>
#include <memory>
#include <sstream>
#include <system_error>
#include <vector>

#include "clients/cpp/error.h"

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

std::string lower_ending(const fs::path& path) { return lower(path.extension().string()); }

v1::MeshFile mesh_file(const fs::path& path, const std::string& field) {
  v1::MeshFile file;
  file.set_name(path.filename().string());
  file.set_content(read_bytes(path, field));
  std::vector<fs::path> beside;
  const std::string ending = lower_ending(path);
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
