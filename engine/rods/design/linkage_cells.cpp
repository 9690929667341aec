#include "engine/rods/design/linkage_cells.h"

#include <array>
#include <numbers>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

/// Directions in which a joint's rods leave it, counter-clockwise about its normal: rod A ahead, B
/// ahead, A behind, B behind.
constexpr int kSpokes = 4;

/// A segment and the end at which it is left or reached.
struct Leg {
  int segment = -1;
  End end = kStart;
};

/// Which leg around a cell is next, and by how much it turns.
class CellWalk {
 public:
  explicit CellWalk(const LinkageGraph& graph)
      : graph_(graph), legs_(graph.joints.size()), slots_(graph.segments.size()) {
    for (std::size_t s = 0; s < graph.segments.size(); ++s) {
      const Segment& segment = graph.segments[s];
      slots_[s] = {-1, -1};
      if (segment.joints[kStart] < 0 || segment.joints[kFinish] < 0) continue;
      for (const End end : {kStart, kFinish}) {
        // A segment leaves its start ahead along itself, its finish against itself.
        const bool ahead = (segment.signs[end] > 0) == (end == kStart);
        const int slot = (ahead ? 0 : 2) + (segment.rods[end] == kRodA ? 0 : 1);
        slots_[s][end] = slot;
        legs_[segment.joints[end]][slot] = {static_cast<int>(s), end};
      }
    }
  }

  [[nodiscard]] bool bounds(int segment) const { return slots_[segment][kStart] >= 0; }
  [[nodiscard]] int joint(const Leg& leg) const {
    return graph_.segments[leg.segment].joints[leg.end];
  }

  struct Turn {
    Leg next;
    double turned;  // to the left [rad]
  };
  /// Turn from the segment that reaches a joint to the one at its right hand seen backwards: the
  /// loop keeps its inside on its left.
  [[nodiscard]] Turn turn(const Leg& reached) const {
    const int at = joint(reached);
    const double angle = graph_.joints[at].opening_angle;
    int slot = slots_[reached.segment][reached.end];
    double corner = 0;
    do {
      slot = (slot + kSpokes - 1) % kSpokes;
      corner += slot % 2 == 0 ? angle : std::numbers::pi - angle;
    } while (legs_[at][slot].segment < 0);
    return {legs_[at][slot], std::numbers::pi - corner};
  }

 private:
  const LinkageGraph& graph_;
  std::vector<std::array<Leg, kSpokes>> legs_;  // of each joint
  std::vector<std::array<int, 2>> slots_;       // of each segment's ends; -1: it bounds nothing
};

}  // namespace

std::vector<std::vector<int>> linkage_cells(const LinkageGraph& graph) {
  const CellWalk walk(graph);
  std::vector<std::array<bool, 2>> left(graph.segments.size(), {false, false});
  std::vector<std::vector<int>> cells;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    if (!walk.bounds(static_cast<int>(s))) continue;
    for (const End end : {kStart, kFinish}) {
      std::vector<int> loop;
      double turned = 0;
      for (Leg leg{static_cast<int>(s), end}; !left[leg.segment][leg.end];) {
        left[leg.segment][leg.end] = true;
        loop.push_back(walk.joint(leg));
        const CellWalk::Turn turn = walk.turn({leg.segment, leg.end == kStart ? kFinish : kStart});
        turned += turn.turned;
        leg = turn.next;
      }
      if (loop.size() > 2 && turned > std::numbers::pi) cells.push_back(std::move(loop));
    }
  }
  return cells;
}

SurfaceMesh surface_through_joints(const LinkageGraph& graph, const Eigen::Matrix3Xd& positions) {
  LIMBER_DEMAND(positions.cols() == static_cast<Eigen::Index>(graph.joints.size()));
  const std::vector<std::vector<int>> cells = linkage_cells(graph);
  if (cells.empty()) {
    throw Error(ErrorCode::kInvalidArgument, "surface.triangles",
                "the linkage's rods enclose no cell through which a surface could go");
  }
  std::vector<Eigen::Vector3d> middles;
  std::vector<Eigen::Vector3i> triangles;
  for (const std::vector<int>& cell : cells) {
    if (cell.size() == 3) {
      triangles.emplace_back(cell[0], cell[1], cell[2]);
      continue;
    }
    const int middle = static_cast<int>(positions.cols()) + static_cast<int>(middles.size());
    middles.emplace_back(Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < cell.size(); ++k) {
      middles.back() += positions.col(cell[k]) / static_cast<double>(cell.size());
      triangles.emplace_back(cell[k], cell[(k + 1) % cell.size()], middle);
    }
  }
  SurfaceMesh mesh;
  mesh.vertices.resize(3, positions.cols() + static_cast<Eigen::Index>(middles.size()));
  mesh.vertices.leftCols(positions.cols()) = positions;
  for (std::size_t k = 0; k < middles.size(); ++k)
    mesh.vertices.col(positions.cols() + static_cast<Eigen::Index>(k)) = middles[k];
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t)
    mesh.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  check_surface_mesh(mesh);
  return mesh;
}

}  // namespace limber::rods
