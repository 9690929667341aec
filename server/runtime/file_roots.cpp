#include "server/runtime/file_roots.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "server/wire/abbreviate.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& path, const fs::path& root) {
  const auto [end, at] = std::mismatch(root.begin(), root.end(), path.begin(), path.end());
  return end == root.end() && at != path.end();
}

std::optional<fs::path> below(const fs::path& root, const fs::path& requested) {
  std::error_code fault;
  const fs::path home = fs::canonical(root, fault);
  if (fault) return std::nullopt;
  const fs::path file =
      fs::canonical(requested.is_absolute() ? requested : home / requested, fault);
  if (fault || !is_below(file, home) || !fs::is_regular_file(file, fault)) return std::nullopt;
  // Readers open companions in the same folder: none of those may lead out either.
  for (const auto& entry : fs::directory_iterator(file.parent_path(), fault)) {
    if (!entry.is_symlink(fault)) continue;
    const fs::path target = fs::canonical(entry.path(), fault);
    if (!fault && !is_below(target, home) && fs::is_regular_file(target, fault))
      return std::nullopt;
  }
  return file;
}

}  // namespace

fs::path FileRoots::resolve(const std::string& path, const std::string& field) const {
  if (path.find('\0') != std::string::npos)
    throw Refusal(proto::ERROR_CODE_NOT_FOUND, field, "a path with a zero byte is none");
  for (const auto& root : roots_) {
    if (auto file = below(root, path)) return *file;
  }
  throw Refusal(proto::ERROR_CODE_NOT_FOUND, field,
                roots_.empty()
                    ? "this server has no mesh folder (--mesh-root); send the file instead"
                    : fmt::format("'{}' is no file below this server's mesh folders",
                                  abbreviate(path, 1000)));
}

PathResolver FileRoots::resolver() const {
  return [roots = *this](const std::string& path, const std::string& field) {
    return roots.resolve(path, field);
  };
}

}  // namespace limber::server
