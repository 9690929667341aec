#include "server/kinds/bodies/base_motions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <unordered_map>

#include "engine/scene/formats/point_cache.h"
#include "engine/scene/formats/vtu_series.h"
#include "server/kinds/bodies/mesh_sources.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool is_cache(const fs::path& path) { return ending_of(path) == ".pc2"; }

Eigen::MatrixXd read_cache(const std::string& bytes, const std::string& field) {
  return scene::read_pc2(field, bytes).positions.cast<double>();
}

/// Files that are named one by one.
Eigen::MatrixXd read_named(const std::vector<std::string>& paths, const std::string& field,
                           int nodes, const FileReader& read_file) {
  return scene::read_vtu_series(
      field, paths.size(),
      [&](std::size_t i) {
        return scene::VtuFrame{paths[i], read_file(paths[i], field)};
      },
      nodes);
}

Eigen::MatrixXd read_path(const std::string& path, const std::string& field, int nodes,
                          const FileReader& read_file) {
  if (is_cache(path)) return read_cache(read_file(path, field), field);
  if (ending_of(path) != ".pvd") {
    throw invalid(field, fmt::format("'{}' is neither a .pc2 nor a .pvd; .vtu files are given in "
                                     "vtu_series.paths",
                                     path));
  }
  std::vector<std::string> files = scene::pvd_files(field, read_file(path, field));
  for (auto& file : files) file = (fs::path(path).parent_path() / file).string();
  return read_named(files, field, nodes, read_file);
}

/// Positions in `files` of the frames, in order.
std::vector<int> frames_of(const proto::VtuSeries& series, const std::string& field) {
  std::vector<int> order;
  if (series.pvd().empty()) {
    for (int i = 0; i < series.files_size(); ++i) order.push_back(i);
    return order;
  }
  std::unordered_map<std::string, int> by_name;
  for (int i = 0; i < series.files_size(); ++i) by_name.emplace(series.files(i).name(), i);
  for (const auto& name : scene::pvd_files(field + ".pvd", series.pvd())) {
    const auto found = by_name.find(name);
    if (found == by_name.end()) {
      throw Refusal(proto::ERROR_CODE_NOT_FOUND, field + ".files",
                    fmt::format("the .pvd lists {}, which is not among the files", name));
    }
    order.push_back(found->second);
  }
  return order;
}

Eigen::MatrixXd read_series(const proto::VtuSeries& series, const std::string& field, int nodes,
                            const FileReader& read_file) {
  if (series.paths_size() > 0) {
    if (series.files_size() > 0 || !series.pvd().empty())
      throw invalid(field + ".paths", "are given in place of files and pvd, not with them");
    return read_named({series.paths().begin(), series.paths().end()}, field + ".paths", nodes,
                      read_file);
  }
  for (int i = 0; i < series.files_size(); ++i) {
    if (series.files(i).companions_size() > 0)
      throw invalid(fmt::format("{}.files[{}].companions", field, i), "a .vtu file has none");
  }
  const std::vector<int> order = frames_of(series, field);
  return scene::read_vtu_series(
      field + ".files", order.size(),
      [&](std::size_t i) {
        const auto& file = series.files(order[i]);
        return scene::VtuFrame{file.name(), file.content()};
      },
      nodes);
}

}  // namespace

Eigen::MatrixXd read_base_motion(const proto::BaseMotion& motion, const std::string& field,
                                 int nodes, const FileReader& read_file) {
  switch (motion.source_case()) {
    case proto::BaseMotion::kPc2:
      return read_cache(motion.pc2(), field + ".pc2");
    case proto::BaseMotion::kVtuSeries:
      return read_series(motion.vtu_series(), field + ".vtu_series", nodes, read_file);
    case proto::BaseMotion::kPath:
      return read_path(motion.path(), field + ".path", nodes, read_file);
    case proto::BaseMotion::kPositions:  // the codec's
    case proto::BaseMotion::kPins:
    case proto::BaseMotion::SOURCE_NOT_SET:
      break;
  }
  throw invalid(field, "a base motion needs positions, pins, pc2, vtu_series or path");
}

MotionReader base_motion_reader(PathResolver resolve) {
  return [resolve = std::move(resolve)](const proto::BaseMotion& motion, const std::string& field,
                                        int nodes) {
    const FileReader read_file = [&](const std::string& path, const std::string& at) {
      return read_file_at(resolve(path, at), at);
    };
    return read_base_motion(motion, field, nodes, read_file);
  };
}

bool is_point_cache(const proto::BaseMotion& motion) {
  return motion.has_pc2() || (motion.has_path() && is_cache(motion.path()));
}

}  // namespace limber::server
