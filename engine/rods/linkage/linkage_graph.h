#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/rods/linkage/line_mesh.h"

namespace limber::rods {

/// The two rods that meet at a joint. Seen along the normal (which points at the viewer), turning
/// rod A counter-clockwise by the opening angle brings it onto rod B.
enum RodOfJoint : int { kRodA = 0, kRodB = 1 };

/// The two ends of a segment.
enum End : int { kStart = 0, kFinish = 1 };

/// A stretch of rod between two graph vertices: one edge of the line mesh, with its direction.
struct Segment {
  std::array<int, 2> vertices;     // of the mesh, start and finish
  std::array<int, 2> joints;       // at its ends; -1: a free end
  std::array<RodOfJoint, 2> rods;  // which rod of the joint it belongs to; kRodA at a free end
  /// +1 where the segment's direction agrees with the joint's vector of that rod, -1 where it runs
  /// against it; +1 at a free end.
  std::array<int, 2> signs;
  std::array<Eigen::Vector3d, 2> points;  // where the vertices are drawn
  double length;                          // between them
};

/// A scissor joint: a mesh vertex of valence 2 to 4 and its frame in the input configuration.
///
///   t_A = cos(a/2) b - sin(a/2) n x b,  t_B = cos(a/2) b + sin(a/2) n x b   (rod linkages, 1.3)
struct Joint {
  int vertex = -1;
  int valence = 0;
  /// Segment of rod r that lies ahead along t_r (index 1) and behind (index 0); -1: none.
  std::array<std::array<int, 2>, 2> segments{{{-1, -1}, {-1, -1}}};
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();    // n, unit
  Eigen::Vector3d bisector = Eigen::Vector3d::UnitX();  // b, unit, orthogonal to n
  double opening_angle = 0;                             // a [rad]

  [[nodiscard]] Eigen::Vector3d tangent(RodOfJoint rod) const;  // t_A or t_B, unit
};

/// Segments and joints of a rod linkage (rod linkages, sec. 1.1, 1.2).
///
/// Joints are numbered in the order of their vertices, segments are the mesh's edges in order. At
/// each vertex the straightest pairs of edges form one rod. Valence 2 pins two ends, valence 3 the
/// end of one rod to another that passes, valence 4 two that pass. If the straightest pairs allow
/// no letters A and B that stay the same along every rod, pairs that are about as straight
/// (detail::kLargestTurn) replace them if these do. The pairs that bend the rods least as a whole
/// are taken (see detail::choose_pairings). Otherwise the straightest pairs stay, and angles are
/// mixed. Normals are oriented continuously over each component.
///
/// The choice of "the" opening angle from a joint's two supplementary angles is continuous too:
/// along a rod the angle stays on the same side, so that crossing rods are A and B by turns. A
/// component leaves two choices; the one with more acute angles is taken. Near 0 or pi the angle
/// may be slightly beyond, where its neighbours say so. Mixed angles are all acute.
struct LinkageGraph {
  std::vector<Segment> segments;
  std::vector<Joint> joints;
  std::vector<int> segment_components;  // component of each segment, from 0
  int components = 0;
  int bent_joints = 0;  // whose rods are not the straightest pairs there
  /// Proven: no other pairs bend the rods less as a whole.
  bool is_bend_least = true;
  /// In some component, angles are on one side of a rod at one joint and on its other side at the
  /// next, as in weaves of three families. A mean of such angles has no meaning.
  bool mixed_angles = false;
};

/// Vertices that no edge uses are passed over.
/// @throws Error as check_line_mesh and detail::orient_joints; {kInvalidArgument} with field
/// vertices[v]: valence above 4, rods that fold back on themselves. Neither that nor the pairs
/// depend on how vertices and edges are numbered
[[nodiscard]] LinkageGraph build_linkage_graph(const LineMesh& mesh);

}  // namespace limber::rods
