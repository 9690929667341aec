#include "engine/rods/linkage/linkage_graph.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/disjoint_sets.h"
#include "engine/base/error.h"
#include "engine/rods/linkage/joint_orientation.h"
#include "engine/rods/linkage/pairing_choice.h"

namespace limber::rods {
namespace {

using detail::JointChoices;
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

/// The place of each vertex in an order by coordinates, which does not know how they are numbered.
std::vector<int> rank_vertices(const LineMesh& mesh) {
  std::vector<int> order(static_cast<std::size_t>(mesh.vertex_count()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    for (int axis = 0; axis < 3; ++axis) {
      const double of_a = mesh.vertices(axis, a), of_b = mesh.vertices(axis, b);
      if (of_a != of_b) return of_a < of_b;
    }
    return a < b;
  });
  std::vector<int> ranks(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) ranks[order[i]] = static_cast<int>(i);
  return ranks;
}

/// The rods of the joints, chosen for the whole mesh.
/// @param vertices  of the joints
/// @param ranks     of the mesh's vertices
/// @param graph     gets the number of joints without their straightest rods, and whether their
/// bend
///                  is the least
std::vector<RodPair> pair_segments(const LineMesh& mesh,
                                   const std::vector<std::vector<Spoke>>& spokes,
                                   const std::vector<int>& vertices, const std::vector<int>& ranks,
                                   LinkageGraph& graph) {
  std::vector<int> order(vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return ranks[vertices[a]] < ranks[vertices[b]]; });
  std::vector<JointChoices> choices;
  std::vector<int> ordered_vertices;
  for (const int j : order) {
    const int vertex = vertices[j];
    JointChoices joint;
    std::vector<int> far_ranks;
    for (const Spoke& spoke : spokes[vertex]) {
      joint.segments.push_back(spoke.segment);
      far_ranks.push_back(ranks[mesh.edges(spoke.end == kStart ? 1 : 0, spoke.segment)]);
    }
    joint.pairings = detail::possible_pairings(spokes[vertex], far_ranks);
    choices.push_back(std::move(joint));
    ordered_vertices.push_back(vertex);
  }
  const detail::PairingChoice choice = detail::choose_pairings(mesh.edge_count(), choices);
  graph.bent_joints = choice.bent;
  graph.is_bend_least = choice.is_least;
  std::vector<RodPair> pairs(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const int vertex = ordered_vertices[i];
    pairs[order[i]] =
        detail::form_rods(spokes[vertex], choices[i].pairings[choice.pairings[i]], vertex);
  }
  return pairs;
}

/// Which of its joints' rods each end of a segment belongs to.
std::vector<std::array<int, 2>> rods_of_ends(const std::vector<RodPair>& pairs, int segments) {
  std::vector<std::array<int, 2>> rods(static_cast<std::size_t>(segments), {0, 0});
  for (const RodPair& pair : pairs)
    for (int r = 0; r < 2; ++r)
      for (const Spoke& spoke : pair.rods[r]) rods[spoke.segment][spoke.end] = r;
  return rods;
}

std::vector<JointLink> find_links(const LinkageGraph& graph, const std::vector<RodPair>& pairs) {
  const std::vector<std::array<int, 2>> rods =
      rods_of_ends(pairs, static_cast<int>(graph.segments.size()));
  std::vector<JointLink> links;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = graph.segments[s];
    if (segment.joints[0] < 0 || segment.joints[1] < 0) continue;
    links.push_back({static_cast<int>(s), segment.joints, rods[s],
                     (segment.points[kFinish] - segment.points[kStart]).normalized()});
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
  for (const RodOfJoint rod : {kRodA, kRodB}) {
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
  const auto count = static_cast<std::size_t>(mesh.vertex_count());
  DisjointSets connected(count);
  for (const Segment& segment : graph.segments)
    connected.join(segment.vertices[0], segment.vertices[1]);
  std::vector<int> number(count, -1);
  for (const Segment& segment : graph.segments) {
    int& component = number[connected.lowest(segment.vertices[0])];
    if (component < 0) component = graph.components++;
    graph.segment_components.push_back(component);
  }
}

}  // namespace

Eigen::Vector3d Joint::tangent(RodOfJoint rod) const {
  const double sine = rod == kRodA ? -std::sin(opening_angle / 2) : std::sin(opening_angle / 2);
  return std::cos(opening_angle / 2) * bisector + sine * normal.cross(bisector);
}

LinkageGraph build_linkage_graph(const LineMesh& mesh) {
  check_line_mesh(mesh);
  const std::vector<std::vector<Spoke>> spokes = collect_spokes(mesh);
  LinkageGraph graph;
  std::vector<int> joint_of(spokes.size(), -1);
  std::vector<int> vertices;
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    if (spokes[v].size() < 2) continue;
    joint_of[v] = static_cast<int>(vertices.size());
    vertices.push_back(v);
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
  const std::vector<int> ranks = rank_vertices(mesh);
  const std::vector<RodPair> pairs = pair_segments(mesh, spokes, vertices, ranks, graph);
  std::vector<detail::JointPlace> places;
  for (const int v : vertices) {
    places.push_back({v, ranks[v], mesh.vertices.col(v)});
    if (mesh.normals.cols() > 0) places.back().normal = mesh.normals.col(v).stableNormalized();
  }
  const JointOrientations orientations =
      detail::orient_joints(pairs, find_links(graph, pairs), places);
  graph.mixed_angles = orientations.is_mixed;
  for (std::size_t j = 0; j < pairs.size(); ++j)
    set_joint(pairs[j], orientations, static_cast<int>(j), graph);
  number_components(mesh, graph);
  return graph;
}

}  // namespace limber::rods
