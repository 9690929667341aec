#include "engine/session/linkage/linkage_remarks.h"

#include <fmt/format.h>

#include <string>

#include "engine/rods/linkage/line_meetings.h"
#include "engine/session/linkage/unit_name.h"

namespace limber::session {
namespace {

using rods::LineMeeting;

std::string told(const LineMeeting& meeting) {
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

}  // namespace

std::vector<scene::Issue> linkage_remarks(const scene::Linkage& linkage) {
  constexpr auto kWarning = scene::Issue::Severity::kWarning;
  const rods::LineMeetings meetings = rods::find_line_meetings(linkage.lines);
  const std::string unit = unit_name(linkage.length_unit_in_metres);
  std::vector<scene::Issue> issues;
  for (const LineMeeting& meeting : meetings.listed) {
    const Eigen::Vector3d& place = meeting.place;
    issues.push_back(
        {kWarning, "lines",
         fmt::format("{} (from 0), at ({:.6g}, {:.6g}, {:.6g}) {}: nothing joins them there",
                     told(meeting), place.x(), place.y(), place.z(), unit)});
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
