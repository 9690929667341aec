// Files of tetrahedral meshes, as they are uploaded: NAME, a line end, the bytes; then, behind a
// line
// "%%%", a companion in the same form, and so on. Materials of .elastic and lists of fixed nodes
// too.
#include <string>

#include "engine/bodies/mesh_validation.h"
#include "engine/scene/formats/material_files.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/readers.h"
#include "tests/fuzz/input.h"

using namespace limber;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest = fuzz::text_of(data, size);
  scene::MeshFileSet files;
  std::string_view file = fuzz::take_until(rest, "\n%%%\n");
  files.name = fuzz::take_name(file);
  files.content = file;
  while (!rest.empty() && files.companions.size() < 4) {
    file = fuzz::take_until(rest, "\n%%%\n");
    std::string name = fuzz::take_name(file);
    files.companions[std::move(name)] = file;
  }
  fuzz::reads([&] { (void)scene::formats::vega_includes(files.content); });
  fuzz::reads([&] { (void)scene::read_fixed_nodes(files.name, files.content, 100); });
  scene::MeshReading reading;
  const bool is_mesh =
      fuzz::reads([&] { reading = scene::read_mesh(files, {.array_bytes = 16 << 20}); });
  if (is_mesh) fuzz::reads([&] { (void)bodies::prepare_mesh(reading.mesh, {}); });
  return 0;
}
