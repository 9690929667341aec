#include "engine/session/linkages/remarks.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/numerics/median.h"
#include "engine/rods/linkage/line_meetings.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/section/section_reach.h"
#include "engine/session/linkages/unit_name.h"

namespace limber::session {
namespace {

using rods::LineMeeting;

std::string describe(const LineMeeting& meeting) {
  const auto& edges = meeting.edges;
  const auto& vertices = meeting.vertices;
  switch (meeting.kind) {
    case LineMeeting::Kind::kVertices:
      return fmt::format("edges {} and {} end at one place, but at vertices {} and {}", edges[0],
                         edges[1], vertices[0], vertices[1]);
    case LineMeeting::Kind::kVertexEdge: {
      const int on = vertices[0] >= 0 ? 0 : 1;
      return fmt::format("edge {} ends on edge {}, at vertex {}", edges[on], edges[1 - on],
                         vertices[on]);
    }
    case LineMeeting::Kind::kEdges:
      break;
  }
  return fmt::format("edges {} and {} cross without a vertex", edges[0], edges[1]);
}

/// The remark on sections that are likely in another unit than the lines.
std::optional<std::string> describe_section_size(const scene::Linkage& linkage,
                                                 const std::string& unit) {
  const auto& [vertices, edges] = linkage.lines;
  const Eigen::Array2d size = rods::outline_size(linkage.section);
  const double thick = size.minCoeff(), wide = size.maxCoeff();
  const double across = (vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff()).norm();
  if (across > rods::kMaxSlenderness * thick) {
    return fmt::format(
        "the linkage is {:.3g} {unit} across and its rods {:.3g} {unit} thick, more "
        "than {:g} to 1: is the section in the unit of the lines?",
        across, thick, rods::kMaxSlenderness, fmt::arg("unit", unit));
  }
  std::vector<double> lengths;
  for (Eigen::Index k = 0; k < edges.cols(); ++k)
    lengths.push_back((vertices.col(edges(1, k)) - vertices.col(edges(0, k))).norm());
  const double middle = median(std::move(lengths));
  if (wide <= middle) return {};
  return fmt::format(
      "the section is {:.3g} {unit} wide, and half of the lines are shorter than "
      "{:.3g} {unit}: is the section in the unit of the lines?",
      wide, middle, fmt::arg("unit", unit));
}

/// The remark on linkages of the size of landscapes: files do not say their unit.
std::optional<std::string> describe_large_extent(const scene::Linkage& linkage) {
  constexpr double kLargest = 1000;  // [m]
  const auto& vertices = linkage.lines.vertices;
  const Eigen::Vector3d box = vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff();
  const double unit = linkage.length_unit_in_metres;
  if (!(box.maxCoeff() * unit > kLargest)) return {};
  return fmt::format(
      "the linkage is {:.3g} km x {:.3g} km x {:.3g} km large, with {:g} m in a length unit: if "
      "its "
      "lines are in millimetres, set length_unit_in_metres to 0.001",
      1e-3 * unit * box.x(), 1e-3 * unit * box.y(), 1e-3 * unit * box.z(), unit);
}

/// The remark on meshes that are too wide for the least bend of rods to be proven.
std::optional<std::string> describe_pairing(const scene::Linkage& linkage) {
  const rods::LinkageGraph graph = rods::build_linkage_graph(linkage.lines);
  if (graph.is_bend_least) return {};
  return fmt::format(
      "the straightest pairs of segments do not fit together as two families of rods: at {} of {} "
      "joints others were chosen that may bend the rods more than necessary; check the rods there, "
      "or draw straighter ones",
      graph.bent_joints, graph.joints.size());
}

}  // namespace

std::vector<scene::Issue> linkage_remarks(const scene::Linkage& linkage) {
  constexpr auto kWarning = scene::Issue::Severity::kWarning;
  const rods::LineMeetings meetings = rods::find_line_meetings(linkage.lines);
  const std::string unit = unit_name(linkage.length_unit_in_metres);
  std::vector<scene::Issue> issues;
  if (const auto large = describe_large_extent(linkage))
    issues.push_back({kWarning, "length_unit_in_metres", *large});
  if (const auto size = describe_section_size(linkage, unit))
    issues.push_back({kWarning, "section", *size});
  if (const auto pairing = describe_pairing(linkage))
    issues.push_back({kWarning, "lines", *pairing});
  for (const LineMeeting& meeting : meetings.listed) {
    const Eigen::Vector3d& place = meeting.place;
    issues.push_back(
        {kWarning, "lines",
         fmt::format("{} (from 0), at ({:.6g}, {:.6g}, {:.6g}) {}: nothing joins them there",
                     describe(meeting), place.x(), place.y(), place.z(), unit)});
  }
  const int more = meetings.count - static_cast<int>(meetings.listed.size());
  if (more > 0) {
    issues.push_back({kWarning, "lines",
                      fmt::format("edges touch where nothing joins them in {}{} more places",
                                  meetings.all ? "" : "at least ", more)});
  }
  return issues;
}

}  // namespace limber::session
