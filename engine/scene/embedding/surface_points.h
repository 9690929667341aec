#pragma once

#include <memory>
#include <vector>

#include "engine/bodies/boundary_surface.h"
#include "engine/scene/scene.h"

namespace limber::scene {

/// A weighted mean of nodes.
struct NodeMean {
  std::vector<int> nodes;       // source node ids
  std::vector<double> weights;  // of each, their sum is 1 to rounding; empty: equal ones
};

/// Whether no node but such ones counts.
template <class IsFixed>
[[nodiscard]] bool is_fixed(const NodeMean& mean, const IsFixed& is_fixed_node) {
  for (std::size_t i = 0; i < mean.nodes.size(); ++i) {
    if ((mean.weights.empty() || mean.weights[i] != 0) && !is_fixed_node(mean.nodes[i]))
      return false;
  }
  return true;
}

/// Triangles of a mesh's boundary as clients know them, of source nodes.
/// @param tets  of the prepared mesh; @param source_of_compact  of bodies::PreparedMesh
[[nodiscard]] bodies::SurfaceTriangles mesh_surface(const bodies::TetNodes& tets,
                                                    const std::vector<int>& source_of_compact);

/// The objects that a scene's constraints hold: groups of nodes, points of its surfaces, vertices
/// of the carried one. The scene's boundary and the embedding of its surface are computed on first
/// use, in a pass over the tets. Thread-safe.
class SurfacePoints {
 public:
  /// @param scene  outlives this
  explicit SurfacePoints(const Scene& scene);
  ~SurfacePoints();

  /// That one of nodes, point and surface vertex is named, and of the last two that they are there;
  /// not the nodes themselves.
  /// @throws Error with a field relative to the constraint ("point.triangle"), or, of a point of a
  /// mesh that cannot be prepared, with a field of the scene
  void check(const Constraint& constraint) const;
  /// Whether check() throws no Error that is about the mesh.
  [[nodiscard]] bool can_check(const Constraint& constraint) const;
  /// @param constraint  that check() accepts; the mesh is valid
  [[nodiscard]] NodeMean nodes_of(const Constraint& constraint) const;
  /// Finds out now what the first check() and nodes_of() of such a constraint would have to.
  void prepare(const Constraint& constraint) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// How many nodes a constraint counts as where memory is bounded.
[[nodiscard]] std::size_t node_count_of(const Constraint& constraint);

}  // namespace limber::scene
