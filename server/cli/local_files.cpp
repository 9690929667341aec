#include "server/cli/local_files.h"

#include <fstream>

#include "engine/base/error.h"

namespace limber::server {

namespace fs = std::filesystem;

PathResolver paths_beside(const fs::path& scene_file) {
  return [folder = scene_file.parent_path()](const std::string& path, const std::string&) {
    return folder / path;
  };
}

void write_file(const fs::path& path, const std::string& content, WriteMode mode) {
  std::ofstream out(
      path, std::ios::binary | (mode == WriteMode::kAppend ? std::ios::app : std::ios::trunc));
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  if (!out.flush()) throw Error(ErrorCode::kIo, path.string(), "cannot be written");
}

}  // namespace limber::server
