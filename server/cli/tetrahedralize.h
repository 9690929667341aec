#pragma once

#include <filesystem>

#include "engine/scene/tetrahedralize/tetrahedralize.h"

namespace limber::server {

struct TetrahedralizeCommand {
  std::filesystem::path surface, output;
  scene::TetrahedralizeOptions options;
  bool json = false;
};

/// Fills the surface with tets, writes the mesh and prints how near it is. @returns the exit code.
int tetrahedralize_file(const TetrahedralizeCommand& command);

}  // namespace limber::server
