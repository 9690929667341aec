#include "clients/cpp/bodies/motion_files.h"

#include <algorithm>
#include <cctype>
#include <pugixml.hpp>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/error.h"
#include "clients/cpp/files.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

/// Files that a .pvd names, to be sent along; the server parses their attributes, and may refuse
/// them.
std::vector<std::string> names_in(const std::string& pvd) {
  pugi::xml_document document;
  document.load_buffer(pvd.data(), pvd.size());
  std::vector<std::string> names;
  for (const auto& match : document.select_nodes("//DataSet[@file]")) {
    const std::string name = match.node().attribute("file").value();
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

void add_file(v1::VtuSeries& series, const std::string& name, const fs::path& folder,
              const std::string& field) {
  auto* file = series.add_files();
  file->set_name(name);
  file->set_content(read_bytes(folder / name, field));
}

}  // namespace

void put_motion_bytes(v1::BaseMotion& motion, const fs::path& folder) {
  if (motion.has_path()) {
    const std::string field = "base_motion.path";
    const fs::path path = folder / motion.path();
    const std::string ending = lower_ending(path);
    if (ending == ".pc2") {
      motion.set_pc2(read_bytes(path, field));
    } else if (ending == ".pvd") {
      v1::VtuSeries series;
      series.set_pvd(read_bytes(path, field));
      for (const auto& name : names_in(series.pvd()))
        add_file(series, name, path.parent_path(), field);
      *motion.mutable_vtu_series() = std::move(series);
    } else {
      throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                        path.string() +
                            " is neither a .pc2 nor a .pvd; .vtu files are given in "
                            "base_motion.vtu_series.paths");
    }
  } else if (motion.vtu_series().paths_size() > 0) {
    v1::VtuSeries& series = *motion.mutable_vtu_series();
    for (int i = 0; i < series.paths_size(); ++i)
      add_file(series, series.paths(i), folder,
               "base_motion.vtu_series.paths[" + std::to_string(i) + "]");
    series.clear_paths();
  }
}

}  // namespace limber::client
