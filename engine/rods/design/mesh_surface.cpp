#include "engine/rods/design/mesh_surface.h"

#include <Eigen/Geometry>
#include <limits>
#include <unsupported/Eigen/BVH>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/rods/design/triangle_projection.h"

namespace limber::rods {
namespace {

// Eigen's hierarchy is in double precision, so that nothing has to be refined afterwards (Embree
// answers in float32). It is halved by counting, so that it depends on the triangles alone. It adds
// no dependency.
using Boxes = Eigen::KdBVH<double, 3, int>;

Boxes boxes_of(const SurfaceMesh& mesh) {
  std::vector<int> triangles;
  std::vector<Boxes::Volume> volumes;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Matrix3d triangle = corners(mesh, t);
    if (!has_area(triangle)) continue;
    triangles.push_back(static_cast<int>(t));
    volumes.emplace_back(triangle.rowwise().minCoeff(), triangle.rowwise().maxCoeff());
  }
  return {triangles.begin(), triangles.end(), volumes.begin(), volumes.end()};
}

double area_of(const SurfaceMesh& mesh) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Matrix3d at = corners(mesh, t);
    sum += 0.5 * (at.col(1) - at.col(0)).cross(at.col(2) - at.col(0)).norm();
  }
  return sum;
}

/// Queries of Eigen's search. Boxes come in the order of their distances, those beyond the nearest
/// triangle so far are left out: the answer is that of a search through all triangles.
struct Nearest {
  using Scalar = double;

  [[nodiscard]] double minimumOnVolume(const Boxes::Volume& box) const {
    return box.squaredExteriorDistance(point);
  }
  double minimumOnObject(int triangle) {
    const ClosestPoint candidate = project_onto_triangle(corners(mesh, triangle), point);
    const double squared = (point - candidate.position).squaredNorm();
    if (squared < least) {
      least = squared;
      closest = candidate;
    }
    return squared;
  }

  const SurfaceMesh& mesh;
  const Eigen::Vector3d& point;
  ClosestPoint closest = {};
  double least = std::numeric_limits<double>::infinity();
};

}  // namespace

struct MeshSurface::Impl {
  explicit Impl(SurfaceMesh given) : mesh(std::move(given)) {
    check_surface_mesh(mesh);
    boxes = boxes_of(mesh);
  }
  SurfaceMesh mesh;
  Boxes boxes;
};

MeshSurface::MeshSurface(SurfaceMesh mesh)
    : impl_(std::make_unique<Impl>(std::move(mesh))), area_(area_of(impl_->mesh)) {}
MeshSurface::~MeshSurface() = default;

const SurfaceMesh& MeshSurface::mesh() const { return impl_->mesh; }

ClosestPoint MeshSurface::closest(const Eigen::Vector3d& point) const {
  LIMBER_DEMAND(point.allFinite());
  Nearest nearest{impl_->mesh, point};
  Eigen::BVMinimize(impl_->boxes, nearest);
  return nearest.closest;
}

}  // namespace limber::rods
