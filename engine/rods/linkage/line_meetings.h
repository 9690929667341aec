#pragma once

#include <vector>

#include "engine/rods/linkage/line_mesh.h"

namespace limber::rods {

/// Two edges of a line mesh that touch without sharing a vertex, so that no joint is there.
struct LineMeeting {
  enum class Kind {
    kEdges,       // within both
    kVertexEdge,  // an end of one within the other
    kVertices,    // ends of both
  };
  Kind kind = Kind::kEdges;
  Eigen::Vector2i edges;             // the first pair that was found there, ascending
  Eigen::Vector2i vertices{-1, -1};  // of each edge, where its end is there
  Eigen::Vector3d place;
};

struct LineMeetings {
  std::vector<LineMeeting> listed;  // by edges, ascending
  int count = 0;                    // all that were found
  bool all = true;                  // or else the search stopped: there may be more
};

/// Edges that come as near to each other as a thousandth of the shorter one, and half the shortest
/// of all.
///
/// Edges closer to parallel than 5.7 degrees are side by side, as in a linkage that is drawn
/// closed. They do not count, unless they continue one another from a loose end to a loose end. The
/// time is that of sorting, and grows with the pairs whose boxes overlap. After 1000 meetings, and
/// after 300 pairs for each edge, the search ends.
/// @pre check_line_mesh has nothing to say
/// @param most  length of the list at most
[[nodiscard]] LineMeetings find_line_meetings(const LineMesh& mesh, int most = 10);

}  // namespace limber::rods
