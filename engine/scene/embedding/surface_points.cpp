#include "engine/scene/embedding/surface_points.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>
#include <optional>
#include <tuple>

#include "engine/base/error.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/scene/embedding/surface_embedding.h"

namespace limber::scene {
namespace {

/// Tolerance of the sum of barycentric weights: rounding of single precision.
constexpr double kWeightSumTolerance = 1e-6;

void check_weights(const Eigen::Vector3d& weights) {
  for (int corner = 0; corner < 3; ++corner) {
    if (weights[corner] >= 0) continue;  // written so that NaN fails
    throw Error(ErrorCode::kInvalidArgument, fmt::format("point.weights[{}]", corner),
                fmt::format("must be >= 0, is {:g}", weights[corner]));
  }
  if (!(std::abs(weights.sum() - 1) <= kWeightSumTolerance)) {
    throw Error(ErrorCode::kInvalidArgument, "point.weights",
                fmt::format("the sum of the weights must be 1 to within {:g}, is {:.8g}",
                            kWeightSumTolerance, weights.sum()));
  }
}

void check_index(const char* field, const char* what, int index, int count) {
  if (index >= 0 && index < count) return;
  throw Error(ErrorCode::kOutOfRange, field,
              fmt::format("{} {} is outside 0 .. {}", what, index, count - 1));
}

}  // namespace

bodies::SurfaceTriangles mesh_surface(const bodies::TetNodes& tets,
                                      const std::vector<int>& source_of_compact) {
  bodies::SurfaceTriangles triangles = bodies::boundary_surface(tets);
  for (int& node : triangles.reshaped()) node = source_of_compact[static_cast<std::size_t>(node)];
  return triangles;
}

class SurfacePoints::Impl {
 public:
  explicit Impl(const Scene& scene) : scene_(scene) {}

  [[nodiscard]] bool is_carried(const SurfacePoint& point) const {
    return point.surface == PointSurface::kCarried ||
           (point.surface == PointSurface::kShown && scene_.surface != nullptr);
  }

  void demand_carried(const char* field) const {
    if (scene_.surface) return;
    throw Error(ErrorCode::kInvalidArgument, field,
                "the scene names no surface: `surface` is its field for one");
  }

  [[nodiscard]] const TriangleSurface& carried() const { return scene_.surface->surface; }

  /// Of the mesh.
  [[nodiscard]] const bodies::SurfaceTriangles& boundary() const {
    std::call_once(boundary_once_, [&] {
      bodies::TetMesh mesh = scene_.mesh;
      mesh.nodes *= scene_.length_unit_in_metres;
      bodies::MeshValidationOptions options;
      if (scene_.merge_tolerance)
        options.merge_tolerance = *scene_.merge_tolerance * scene_.length_unit_in_metres;
      const bodies::PreparedMesh prepared = bodies::prepare_mesh(mesh, scene_.fixed_nodes, options);
      boundary_ = mesh_surface(prepared.mesh.tets, prepared.source_of_compact);
    });
    return boundary_;
  }

  [[nodiscard]] const Embedder& embedder() const {
    std::call_once(embedder_once_, [&] { embedder_.emplace(scene_.mesh.nodes, scene_.mesh.tets); });
    return *embedder_;
  }

  void add_vertex(int vertex, double weight, NodeMean& mean) const {
    const Embedder::Place place = embedder().place(carried().vertices.col(vertex));
    for (int corner = 0; corner < 4; ++corner) {
      mean.nodes.push_back(place.nodes[corner]);
      mean.weights.push_back(weight * place.weights[corner]);
    }
  }

 private:
  const Scene& scene_;
  mutable std::once_flag boundary_once_, embedder_once_;
  mutable bodies::SurfaceTriangles boundary_;
  mutable std::optional<Embedder> embedder_;
};

SurfacePoints::SurfacePoints(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
SurfacePoints::~SurfacePoints() = default;

void SurfacePoints::check(const Constraint& constraint) const {
  const auto& [nodes, point, vertex] =
      std::tie(constraint.nodes, constraint.point, constraint.surface_vertex);
  if (nodes.empty() && !point && !vertex) {
    throw Error(ErrorCode::kInvalidArgument, "nodes",
                "a constraint needs at least one node, a point of a surface or a surface vertex");
  }
  if (!nodes.empty() + point.has_value() + vertex.has_value() > 1) {
    throw Error(ErrorCode::kInvalidArgument, vertex ? "surface_vertex" : "point",
                fmt::format("{} given too: a constraint names one of nodes, point and "
                            "surface_vertex",
                            nodes.empty() ? "a point is" : "nodes are"));
  }
  if (vertex) {
    impl_->demand_carried("surface_vertex");
    check_index("surface_vertex", "vertex", *vertex, impl_->carried().vertex_count());
  }
  if (!point) return;
  if (point->surface == PointSurface::kCarried) impl_->demand_carried("point.surface");
  check_index("point.triangle", "triangle", point->triangle,
              impl_->is_carried(*point) ? impl_->carried().triangle_count()
                                        : static_cast<int>(impl_->boundary().cols()));
  check_weights(point->weights);
}

bool SurfacePoints::can_check(const Constraint& constraint) const {
  if (!constraint.point || impl_->is_carried(*constraint.point)) return true;
  try {
    static_cast<void>(impl_->boundary());
    return true;
  } catch (const Error& /*of_the_mesh*/) {
    return false;
  }
}

NodeMean SurfacePoints::nodes_of(const Constraint& constraint) const {
  NodeMean mean;
  if (constraint.surface_vertex) {
    impl_->add_vertex(*constraint.surface_vertex, 1, mean);
  } else if (constraint.point) {
    const SurfacePoint& point = *constraint.point;
    const Eigen::Vector3d weights = point.weights / point.weights.sum();
    for (int corner = 0; corner < 3; ++corner) {
      if (impl_->is_carried(point)) {
        impl_->add_vertex(impl_->carried().triangles(corner, point.triangle), weights[corner],
                          mean);
      } else {
        mean.nodes.push_back(impl_->boundary()(corner, point.triangle));
        mean.weights.push_back(weights[corner]);
      }
    }
  } else {
    mean.nodes = constraint.nodes;
  }
  return mean;
}

void SurfacePoints::prepare(const Constraint& constraint) const {
  if (constraint.point && !impl_->is_carried(*constraint.point)) {
    static_cast<void>(impl_->boundary());
  } else if (constraint.point || constraint.surface_vertex) {
    static_cast<void>(impl_->embedder());
  }
}

std::size_t node_count_of(const Constraint& constraint) {
  constexpr std::size_t kOfPoint = 12, kOfVertex = 4;
  return constraint.nodes.size() + (constraint.point ? kOfPoint : 0) +
         (constraint.surface_vertex ? kOfVertex : 0);
}

}  // namespace limber::scene
