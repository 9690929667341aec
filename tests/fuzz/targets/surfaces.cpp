// Files of surfaces, lines and motions: the first byte chooses the reader, a line with the file's
// name ends, the bytes follow. Two files are separated by a line "%%%".
#include <string>

#include "clients/cpp/obj_lines.h"
#include "engine/scene/formats/beam_job.h"
#include "engine/scene/formats/edge_formats.h"
#include "engine/scene/formats/line_formats.h"
#include "engine/scene/formats/point_cache.h"
#include "engine/scene/formats/stiffness_files.h"
#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/formats/vtu_series.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;

/// Frames of a motion, one file each.
void read_series(std::string_view files) {
  (void)scene::read_vtu_series(
      "series", 3,
      [&](std::size_t) -> scene::VtuFrame {
        return {"frame.vtu", std::string(fuzz::take_until(files, "\n%%%\n"))};
      },
      0, 16 << 20);
}

/// @param reader  a letter; the meaning of one never changes: kept inputs have it
void read_file(char reader, const std::string& name, std::string_view content) {
  switch (reader) {
    case 's':
      (void)scene::closed_outward(scene::read_surface(name, content));
      break;
    case 'm':
      (void)scene::material_libraries(content);
      break;
    case 'l':
      (void)scene::read_line_mesh(name, content);
      break;
    case 'e':
      (void)scene::read_edge_mesh(name, content);
      break;
    case 'c':
      (void)scene::read_pc2(name, content);
      break;
    case 'p':
      (void)scene::pvd_files(name, content);
      break;
    case 'v':
      read_series(content);
      break;
    case 'j': {
      const std::string_view job = fuzz::take_until(content, "\n%%%\n");
      (void)scene::read_beam_job(job, content);
      break;
    }
    case 'f':
      (void)scene::read_stiffness(name, content, scene::StiffnessQuantity::kFactor, 4);
      break;
    case 'o':
      (void)client::read_obj_lines(std::string(content));
      break;
    default:
      break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view content = fuzz::text_of(data, size);
  const std::string name = fuzz::take_name(content);
  if (!name.empty()) fuzz::reads([&] { read_file(name.front(), name.substr(1), content); });
  return 0;
}
