#pragma once

#include <Eigen/Core>

#include "engine/base/random.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/linkage/edge_counts.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods::testing {

/// A flat strip of 3 mm x 1 mm in N and mm, on edge: stiff in the surface, soft out of it.
inline constexpr RodStiffness kStrip{6000, 4500, 500, 600};

/// A flat grid whose rods cross at an angle [rad], cells of 40 mm.
inline LinkageModel grid_model(int columns, int rows, double angle, int edges = 6,
                               const RodStiffness& stiffness = kStrip) {
  return {build_linkage_graph(sheared_grid(columns, rows, angle, 40)), edges, stiffness};
}

/// A grid whose rods run aslant and are too long by turns, so that it cannot open in its plane.
inline LinkageModel curved_model(double scale = 1, const RodStiffness& stiffness = kStrip) {
  LineMesh mesh = sheared_grid(4, 4, 0.6, 40 * scale);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d x = mesh.vertices.col(v) / scale;
    mesh.vertices.col(v).x() += scale * 4 * std::sin(0.03 * x.y());
    mesh.vertices.col(v).y() += scale * 3 * std::sin(0.025 * x.x());
    mesh.vertices.col(v).z() += scale * 6 * std::sin(0.02 * (x.x() + x.y()));
  }
  return {build_linkage_graph(mesh), 6, stiffness};
}

/// Joints in rows of four, of which the middle two are `gap` apart, and 40 otherwise; steel of
/// 20 x 10 mm, in N and mm.
inline LinkageModel gapped_model(double gap, int edges) {
  LineMesh mesh;
  const double columns[] = {0, 40, 40 + gap, 80 + gap};
  mesh.vertices.resize(3, 12);
  for (int j = 0; j < 12; ++j) {
    const int row = j / 4;
    mesh.vertices.col(j) << columns[j % 4] + 4 * row, 40 * row, 0;
  }
  mesh.edges.resize(2, 17);
  for (int e = 0; e < 9; ++e) mesh.edges.col(e) << e / 3 * 4 + e % 3, e / 3 * 4 + e % 3 + 1;
  for (int e = 0; e < 8; ++e) mesh.edges.col(9 + e) << e, e + 4;
  const LinkageGraph graph = build_linkage_graph(mesh);
  return {graph, edges_by_length(graph, edges), {4e7, 1.333e9, 3.333e8, 3.5e8}};
}

/// Elastic energy and potential of conditions without moments, written down from the vertices.
inline double total_potential(const LinkageModel& model, const LinkageState& state,
                              const Conditions& conditions) {
  LinkageAssembly assembly(model);
  double sum = assembly.energies(state).total();
  for (const TargetSpring& spring : conditions.springs) {
    Eigen::Vector3d x;
    if (const auto* joint = std::get_if<JointPoint>(&spring.at)) {
      x = state.joints()[joint->joint].position;
    } else if (const auto* vertex = std::get_if<VertexPoint>(&spring.at)) {
      x = state.vertex(model, vertex->segment, vertex->vertex);
    } else {
      const auto& arc = std::get<ArcPoint>(spring.at);
      const double place = arc.share * model.variables().edges(arc.segment);
      const int edge = std::min(static_cast<int>(place), model.variables().edges(arc.segment) - 1);
      x = (edge + 1 - place) * state.vertex(model, arc.segment, edge) +
          (place - edge) * state.vertex(model, arc.segment, edge + 1);
    }
    sum += 0.5 * spring.stiffness * (x - spring.position).squaredNorm();
  }
  for (const JointLoad& load : conditions.loads) {
    sum -= load.force.dot(state.joints()[load.joint].position) +
           load.opening_torque * state.joints()[load.joint].opening_angle;
  }
  for (int s = 0; s < model.variables().segments(); ++s) {
    const int edges = model.variables().edges(s);
    for (int e = 0; e < edges; ++e) {
      const Segment& segment = model.graph().segments[s];
      const bool shared = (e == 0 && segment.joints[kStart] >= 0) ||
                          (e == edges - 1 && segment.joints[kFinish] >= 0);
      const double mass = conditions.gravity.mass_per_length * (shared ? 0.5 : 1) *
                          model.rest_lengths().edge(model.graph(), model.variables(), s, e);
      sum -= mass * conditions.gravity.acceleration.dot(
                        0.5 * (state.vertex(model, s, e) + state.vertex(model, s, e + 1)));
    }
  }
  return sum;
}

/// Largest distance between the joints of two shapes.
inline double joint_distance(const LinkageState& a, const LinkageState& b, double scale = 1) {
  double largest = 0;
  for (std::size_t j = 0; j < a.joints().size(); ++j) {
    largest = std::max(largest, (a.joints()[j].position - scale * b.joints()[j].position).norm());
  }
  return largest;
}

}  // namespace limber::rods::testing
