#include "engine/session/linkages/remarks.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/base/numerics/median.h"
#include "engine/base/rotations/shortest_rotation.h"
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
  const Eigen::Matrix3Xd& vertices = linkage.lines.vertices;
  const Eigen::Matrix2Xi& edges = linkage.lines.edges;
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

/// How sharply rods turn at joints.
struct Corners {
  int count = 0;       // of joints with a rod that turns by more than kCorner
  double largest = 0;  // [rad]
  int vertex = -1;     // where
};
constexpr double kCorner = 60 * kDegree;
constexpr double kCornerRounding = 1e-6;  // hexagons have just that

Corners corners_of(const rods::LinkageGraph& graph) {
  Corners corners;
  for (const rods::Joint& joint : graph.joints) {
    double turn = 0;
    for (const auto& [behind, ahead] : joint.segments) {
      if (behind < 0 || ahead < 0) continue;
      Eigen::Vector3d directions[2];  // along the rod
      for (const int s : {behind, ahead}) {
        const rods::Segment& segment = graph.segments[static_cast<std::size_t>(s)];
        const Eigen::Vector3d along = (segment.points[1] - segment.points[0]).normalized();
        const bool leaves = segment.vertices[0] == joint.vertex;
        directions[s == ahead ? 1 : 0] = leaves == (s == ahead) ? along : Eigen::Vector3d(-along);
      }
      turn = std::max(turn, std::atan2(directions[0].cross(directions[1]).norm(),
                                       directions[0].dot(directions[1])));
    }
    if (turn > kCorner + kCornerRounding) ++corners.count;
    if (turn <= corners.largest) continue;
    corners.largest = turn;
    corners.vertex = joint.vertex;
  }
  return corners;
}

/// The segments along which the normal of the surface, carried with the rod from joint to joint,
/// turns so far that the side of the next joint is a guess.
std::vector<int> unclear_segments(const rods::LinkageGraph& graph) {
  constexpr double kLeastCosine = 0.5;
  std::vector<int> found;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const rods::Segment& segment = graph.segments[s];
    if (segment.joints[0] < 0 || segment.joints[1] < 0) continue;
    const Eigen::Vector3d along = (segment.points[1] - segment.points[0]).normalized();
    const auto joint = [&](std::size_t end) -> const rods::Joint& {
      return graph.joints[static_cast<std::size_t>(segment.joints[end])];
    };
    const auto tangent = [&](std::size_t end) -> Eigen::Vector3d {
      return segment.signs[end] * joint(end).tangent(segment.rods[end]);
    };
    const Eigen::Vector3d carried =
        rotations::shortest_rotation(along, tangent(1)) *
        (rotations::shortest_rotation(tangent(0), along) * joint(0).normal);
    if (carried.dot(joint(1).normal) < kLeastCosine) found.push_back(static_cast<int>(s));
  }
  return found;
}

/// Remarks on which segments are one rod, and on the surface that they lie on.
/// @param are_sides_given  by normals
std::vector<std::string> describe_rods(const rods::LinkageGraph& graph, bool are_sides_given) {
  std::vector<std::string> remarks;
  if (graph.bent_joints > 0) {
    remarks.push_back(fmt::format(
        "the straightest pairs of segments do not fit together as two families of rods: at {} of "
        "{} joints others were chosen that are nearly as straight{}; check the rods there",
        graph.bent_joints, graph.joints.size(),
        graph.is_bend_least ? "" : ", and may bend the rods more than necessary"));
  }
  if (graph.mixed_angles) {
    remarks.emplace_back(
        "the rods are no two families that cross each other: what opens one joint closes the next, "
        "so that no mean opening angle can be asked for");
  }
  const Corners corners = corners_of(graph);
  if (corners.count > 0) {
    remarks.push_back(
        fmt::format("at {} of {} joints a rod turns by more than {:.0f} degrees, by {:.0f} at "
                    "vertex {} (from 0): "
                    "the straightest pairs of segments are one rod; check the lines there",
                    corners.count, graph.joints.size(), kCorner / kDegree,
                    corners.largest / kDegree, corners.vertex));
  }
  const std::vector<int> unclear = are_sides_given ? std::vector<int>{} : unclear_segments(graph);
  if (!unclear.empty()) {
    remarks.push_back(
        fmt::format("along {} of {} edges, edge {} (from 0) the first, the surface turns by more "
                    "than 60 degrees from joint to joint: which side of it is which is a guess "
                    "there; give normals, or draw more joints",
                    unclear.size(), graph.segments.size(), unclear.front()));
  }
  return remarks;
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
  for (const std::string& remark :
       describe_rods(rods::build_linkage_graph(linkage.lines), linkage.lines.normals.cols() > 0))
    issues.push_back({kWarning, "lines", remark});
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
