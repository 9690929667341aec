#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "engine/scene/triangle_surface.h"

namespace limber::scene::lattice {

/// A tree of boxes over the triangles of a closed surface: distance to it, and whether a point is
/// inside.
class TriangleTree {
 public:
  /// @param surface  closed and oriented outward (closed_outward); must outlive the tree
  explicit TriangleTree(const TriangleSurface& surface);

  struct Nearest {
    double distance = 0;
    int triangle = -1;
  };
  [[nodiscard]] Nearest nearest(const Eigen::Vector3d& x) const;
  /// Unsigned distance to the nearest triangle.
  [[nodiscard]] double distance(const Eigen::Vector3d& x) const { return nearest(x).distance; }
  /// Unsigned distance to one triangle.
  [[nodiscard]] double distance(const Eigen::Vector3d& x, int triangle) const;
  /// Generalised winding number: 1 inside, 0 outside, 2 where two parts overlap. Far clusters of
  /// triangles count as a dipole (Barill et al. 2018, order 1), near ones exactly: good to about
  /// 1e-2.
  [[nodiscard]] double winding_number(const Eigen::Vector3d& x) const;
  /// Negative inside.
  [[nodiscard]] double signed_distance(const Eigen::Vector3d& x) const {
    return winding_number(x) > 0.5 ? -distance(x) : distance(x);
  }
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const { return nodes_[0].box; }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    Eigen::Vector3d area_vector = {0, 0, 0};  // sum of area times normal
    Eigen::Vector3d centre = {0, 0, 0};       // mean, weighted by area
    double radius = 0;                        // of a ball around `centre` that holds the triangles
    int left = -1, right = -1;                // children; -1: a leaf
    int begin = 0, end = 0;                   // range of order_
  };

  int build(int begin, int end, const Eigen::Matrix3Xd& centroids);
  void summarise(Node& node) const;
  [[nodiscard]] Eigen::Vector3d corner(int triangle, int c) const {
    return surface_.vertices.col(surface_.triangles(c, triangle));
  }

  const TriangleSurface& surface_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace limber::scene::lattice
