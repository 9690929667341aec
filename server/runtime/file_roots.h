#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/wire/errors.h"
#include "server/wire/paths.h"

namespace limber::server {

/// The folders of this machine below which clients may name files.
class FileRoots {
 public:
  explicit FileRoots(std::vector<std::filesystem::path> roots) : roots_(std::move(roots)) {}

  /// The one existing file below a root that `path` means. Nothing outside is reached, by .. or
  /// symbolic links, and whether it exists is not disclosed.
  /// @throws Refusal NOT_FOUND naming `field`
  [[nodiscard]] std::filesystem::path resolve(const std::string& path,
                                              const std::string& field) const;
  /// The same as a value that outlives this.
  [[nodiscard]] PathResolver resolver() const;

 private:
  std::vector<std::filesystem::path> roots_;
};

}  // namespace limber::server
