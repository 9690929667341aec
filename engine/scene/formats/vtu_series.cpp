#include "engine/scene/formats/vtu_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <pugixml.hpp>
#include <string_view>
#include <unordered_set>

#include "engine/base/error.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene {
namespace {

[[noreturn]] void refuse_series(const std::string& name, const std::string& message,
                                ErrorCode code = ErrorCode::kInvalidArgument) {
  throw Error(code, name, message);
}

struct TimedFile {
  double time = 0;
  std::string file;
};

std::vector<TimedFile> data_sets(const std::string& name, const pugi::xml_node& collection) {
  std::vector<TimedFile> found;
  for (const pugi::xml_node set : collection.children("DataSet")) {
    // Without a time, as some programs write them: the order is that of the file.
    const double time = set.attribute("timestep").as_double(static_cast<double>(found.size()));
    const std::string file = set.attribute("file").as_string();
    if (file.empty()) refuse_series(name, fmt::format("DataSet {} names no file", found.size()));
    if (!std::isfinite(time))
      refuse_series(name, fmt::format("{} has no time that is finite", file));
    found.push_back({time, file});
  }
  return found;
}

}  // namespace

std::vector<std::string> pvd_files(const std::string& name, std::string_view content) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(content.data(), content.size());
  if (!parsed) refuse_series(name, std::string("not valid XML: ") + parsed.description());
  const pugi::xml_node root = document.child("VTKFile");
  if (std::string_view(root.attribute("type").as_string()) != "Collection")
    refuse_series(name, "is no .pvd: a VTKFile of type 'Collection' is expected");
  std::vector<TimedFile> sets = data_sets(name, root.child("Collection"));
  if (sets.empty()) refuse_series(name, "lists no files");
  std::stable_sort(sets.begin(), sets.end(),
                   [](const TimedFile& a, const TimedFile& b) { return a.time < b.time; });
  std::vector<std::string> files;
  for (std::size_t i = 1; i < sets.size(); ++i) {
    if (sets[i].time == sets[i - 1].time) {
      refuse_series(name,
                    fmt::format("{} and {} are of the same time {:g}: one file per frame is read",
                                sets[i - 1].file, sets[i].file, sets[i].time));
    }
  }
  // A short list of one long file would be read for hours.
  std::unordered_set<std::string_view> listed;
  for (const TimedFile& set : sets) {
    if (!listed.insert(set.file).second)
      refuse_series(
          name,
          fmt::format("{} is listed for two times: each frame has a file of its own", set.file));
  }
  for (TimedFile& set : sets) files.push_back(std::move(set.file));
  return files;
}

Eigen::MatrixXd read_vtu_series(const std::string& name, std::size_t count,
                                const std::function<VtuFrame(std::size_t)>& frame,
                                Eigen::Index node_count, std::size_t max_bytes) {
  if (count == 0) refuse_series(name, "has no frames");
  std::vector<double> positions;  // grows with the frames read, not with `count`
  for (std::size_t i = 0; i < count; ++i) {
    const VtuFrame file = frame(i);
    const std::string where = fmt::format("frame {} ({})", i, file.name);
    Eigen::Matrix3Xd points;
    try {
      points = formats::read_vtu_points(file.name, file.content, max_bytes);
    } catch (const Error& error) {
      throw Error(error.code(), name, where + ": " + error.what());
    }
    const Eigen::Index expected = node_count > 0 || i == 0
                                      ? node_count
                                      : static_cast<Eigen::Index>(positions.size() / (3 * i));
    if (expected > 0 && points.cols() != expected) {
      refuse_series(name, fmt::format("{} has {} points, {} has {} nodes", where, points.cols(),
                                      node_count > 0 ? "the mesh" : "the first frame", expected));
    }
    if (points.cols() == 0) refuse_series(name, where + " has no points");
    // All have as many: known from the first on.
    if (count > max_bytes / sizeof(double) / static_cast<std::size_t>(points.size())) {
      refuse_series(name,
                    fmt::format("{} frames of {} points take more than {} MiB, which is the limit",
                                count, points.cols(), max_bytes >> 20),
                    ErrorCode::kLimitExceeded);
    }
    for (Eigen::Index point = 0; point < points.cols(); ++point) {
      if (!points.col(point).allFinite())
        refuse_series(name, fmt::format("{}: point {} is not finite", where, point));
    }
    positions.insert(positions.end(), points.data(), points.data() + points.size());
  }
  const auto frames = static_cast<Eigen::Index>(count);
  return Eigen::Map<const Eigen::MatrixXd>(
      positions.data(), static_cast<Eigen::Index>(positions.size()) / frames, frames);
}

}  // namespace limber::scene
