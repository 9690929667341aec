#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace limber::scene::testing {

/// A file of the data beside the repository ($LIMBER_SHARED or ../shared); it may not be there.
inline std::filesystem::path shared_body(const std::string& file) {
  const char* const root = std::getenv("LIMBER_SHARED");
  const std::filesystem::path shared = root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared";
  return shared / "data" / "bodies" / file;
}

/// A small file of the tests' own, written by meshio: two cells cut into twelve tets, see
/// data/README.md.
inline std::filesystem::path fixture(const std::string& file) {
  return std::filesystem::path(LIMBER_SOURCE_DIR "/tests/engine/scene/data") / file;
}

}  // namespace limber::scene::testing
