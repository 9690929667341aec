#include "engine/rods/linkage/linkage_graph.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "engine/base/error.h"
#include "engine/rods/linkage/joint_orientation.h"

namespace limber::rods {
namespace {

using detail::JointLink;
using detail::JointOrientations;
using detail::RodPair;
using detail::Spoke;

std::vector<std::vector<Spoke>> collect_spokes(const LineMesh& mesh) {
  std::vector<std::vector<Spoke>> spokes(static_cast<std::size_t>(mesh.vertex_count()));
  for (int e = 0; e < mesh.edge_count(); ++e) {
    const Eigen::Vector3d direction =
        (mesh.vertices.col(mesh.edges(1, e)) - mesh.vertices.col(mesh.edges(0, e))).normalized();
    spokes[mesh.edges(0, e)].push_back({e, kStart, direction});
    spokes[mesh.edges(1, e)].push_back({e, kFinish, -direction});
  }
  for (std::size_t v = 0; v < spokes.size(); ++v) {
    if (spokes[v].size() > 4) {
      throw Error(
          ErrorCode::kInvalidArgument, fmt::format("vertices[{}]", v),
          fmt::format("{} edges meet at vertex {} (from 0); a joint holds two rods, so at most 4",
                      spokes[v].size(), v));
    }
  }
  return spokes;
}

/// Which of a joint's rods a segment end belongs to, and whether it lies ahead (1) or behind (0).
struct Seat {
  int rod = 0;
  int ahead = 1;
};

void find_seats(const RodPair& pair, std::vector<std::array<Seat, 2>>& seats) {
  for (int r = 0; r < 2; ++r) {
    for (std::size_t k = 0; k < pair.rods[r].size(); ++k) {
      const Spoke& spoke = pair.rods[r][k];
      seats[spoke.segment][spoke.end] = {r, k == 0 ? 1 : 0};
    }
  }
}

std::vector<JointLink> find_links(const LinkageGraph& graph,
                                  const std::vector<std::array<Seat, 2>>& seats) {
  std::vector<JointLink> links;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = graph.segments[s];
    if (segment.joints[0] < 0 || segment.joints[1] < 0) continue;
    links.push_back({static_cast<int>(s), segment.joints, {seats[s][0].rod, seats[s][1].rod}});
  }
  return links;
}

/// Writes the frame and the two rods of a joint, and its side of its segments.
void set_joint(const RodPair& pair, const JointOrientations& orientations, int index,
               LinkageGraph& graph) {
  Joint& joint = graph.joints[index];
  const int rod_a = orientations.rod_a[index];
  joint.opening_angle = orientations.angles[index];
  joint.normal = orientations.normals[index];
  const Eigen::Vector3d tangent = pair.tangents[rod_a];
  const Eigen::Vector3d flat = (tangent - joint.normal * joint.normal.dot(tangent)).normalized();
  joint.bisector = std::cos(joint.opening_angle / 2) * flat +
                   std::sin(joint.opening_angle / 2) * joint.normal.cross(flat);
  for (const Rod rod : {kRodA, kRodB}) {
    const int source = rod == kRodA ? rod_a : 1 - rod_a;
    const int direction = rod == kRodA ? 1 : orientations.signs_b[index];
    joint.segments[rod] = {-1, -1};
    for (std::size_t k = 0; k < pair.rods[source].size(); ++k) {
      const Spoke& spoke = pair.rods[source][k];
      const bool ahead = (k == 0) == (direction > 0);
      joint.segments[rod][ahead ? 1 : 0] = spoke.segment;
      Segment& segment = graph.segments[spoke.segment];
      segment.rods[spoke.end] = rod;
      segment.signs[spoke.end] = ahead == (spoke.end == kStart) ? 1 : -1;
    }
  }
}

void number_components(const LineMesh& mesh, LinkageGraph& graph) {
  std::vector<int> root(static_cast<std::size_t>(mesh.vertex_count()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Segment& segment : graph.segments)
    root[find(segment.vertices[0])] = find(segment.vertices[1]);
  std::vector<int> number(root.size(), -1);
  for (const Segment& segment : graph.segments) {
    int& component = number[find(segment.vertices[0])];
    if (component < 0) component = graph.components++;
    graph.segment_components.push_back(component);
  }
}

}  // namespace

Eigen::Vector3d Joint::tangent(Rod rod) const {
  const double sine = rod == kRodA ? -std::sin(opening_angle / 2) : std::sin(opening_angle / 2);
  return std::cos(opening_angle / 2) * bisector + sine * normal.cross(bisector);
}

LinkageGraph build_linkage_graph(const LineMesh& mesh) {
  check_line_mesh(mesh);
  const std::vector<std::vector<Spoke>> spokes = collect_spokes(mesh);
  LinkageGraph graph;
  std::vector<int> joint_of(spokes.size(), -1);
  std::vector<RodPair> pairs;
  std::vector<int> vertices;
  std::vector<std::array<Seat, 2>> seats(static_cast<std::size_t>(mesh.edge_count()));
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    if (spokes[v].size() < 2) continue;
    joint_of[v] = static_cast<int>(vertices.size());
    vertices.push_back(v);
    pairs.push_back(detail::pair_spokes(spokes[v], v));
    find_seats(pairs.back(), seats);
    Joint joint;
    joint.vertex = v;
    joint.valence = static_cast<int>(spokes[v].size());
    joint.position = mesh.vertices.col(v);
    graph.joints.push_back(joint);
  }
  for (int e = 0; e < mesh.edge_count(); ++e) {
    const int a = mesh.edges(0, e);
    const int b = mesh.edges(1, e);
    graph.segments.push_back({{a, b},
                              {joint_of[a], joint_of[b]},
                              {kRodA, kRodA},
                              {1, 1},
                              {mesh.vertices.col(a), mesh.vertices.col(b)},
                              (mesh.vertices.col(b) - mesh.vertices.col(a)).norm()});
  }
  const JointOrientations orientations =
      detail::orient_joints(pairs, find_links(graph, seats), vertices);
  for (std::size_t j = 0; j < pairs.size(); ++j)
    set_joint(pairs[j], orientations, static_cast<int>(j), graph);
  number_components(mesh, graph);
  return graph;
}

}  // namespace limber::rods
