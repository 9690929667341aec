#include "engine/scene/tetrahedralize/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "engine/scene/tetrahedralize/point_triangle.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;

constexpr int kLeafSize = 8;
/// A cluster counts as a dipole from this many radii on.
constexpr double kMinDipoleRadii = 2.3;

/// Solid angle of a triangle seen from the origin (van Oosterom and Strackee 1983).
double solid_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double numerator = a.dot(b.cross(c));
  const double denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return 2 * std::atan2(numerator, denominator);
}

}  // namespace

TriangleTree::TriangleTree(const TriangleSurface& surface) : surface_(surface) {
  order_.resize(static_cast<std::size_t>(surface.triangle_count()));
  std::iota(order_.begin(), order_.end(), 0);
  Eigen::Matrix3Xd centroids(3, surface.triangle_count());
  for (int t = 0; t < surface.triangle_count(); ++t) {
    centroids.col(t) = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
  }
  nodes_.reserve(order_.size() / 2 + 16);
  build(0, static_cast<int>(order_.size()), centroids);
}

int TriangleTree::build(int begin, int end, const Eigen::Matrix3Xd& centroids) {
  const auto id = nodes_.size();
  nodes_.emplace_back();
  nodes_[id].begin = begin;
  nodes_[id].end = end;
  summarise(nodes_[id]);
  if (end - begin > kLeafSize) {
    Eigen::AlignedBox3d box;
    for (int i = begin; i < end; ++i)
      box.extend(centroids.col(order_[static_cast<std::size_t>(i)]));
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    // Halving by count bounds the depth for all triangles; ties are broken by index for
    // equal reruns.
    const int middle = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) {
                       return std::pair(centroids(axis, a), a) < std::pair(centroids(axis, b), b);
                     });
    const int left = build(begin, middle, centroids);
    const int right = build(middle, end, centroids);
    nodes_[id].left = left;
    nodes_[id].right = right;
  }
  return static_cast<int>(id);
}

void TriangleTree::summarise(Node& node) const {
  double area_sum = 0;
  for (int i = node.begin; i < node.end; ++i) {
    const int t = order_[static_cast<std::size_t>(i)];
    const Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    const Vector3d area_vector = 0.5 * (b - a).cross(c - a);
    node.area_vector += area_vector;
    node.centre += area_vector.norm() * (a + b + c) / 3;
    area_sum += area_vector.norm();
    for (const Vector3d& x : {a, b, c}) node.box.extend(x);
  }
  node.centre = area_sum > 0 ? Vector3d(node.centre / area_sum) : node.box.center();
  for (int i = node.begin; i < node.end; ++i) {
    for (int c = 0; c < 3; ++c) {
      node.radius = std::max(node.radius,
                             (corner(order_[static_cast<std::size_t>(i)], c) - node.centre).norm());
    }
  }
}

double TriangleTree::distance(const Vector3d& x, int triangle) const {
  return std::sqrt(
      squared_distance(x, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)));
}

TriangleTree::Nearest TriangleTree::nearest(const Vector3d& x) const {
  int triangle = -1;
  double best = std::numeric_limits<double>::infinity();
  struct Entry {
    int node;
    double bound;
  };
  Entry stack[128];
  int size = 0;
  stack[size++] = {0, nodes_[0].box.squaredExteriorDistance(x)};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.bound >= best) continue;
    const Node& node = nodes_[static_cast<std::size_t>(entry.node)];
    if (node.left < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        const int t = order_[static_cast<std::size_t>(i)];
        const double square = squared_distance(x, corner(t, 0), corner(t, 1), corner(t, 2));
        if (square >= best) continue;
        best = square;
        triangle = t;
      }
      continue;
    }
    Entry near{node.left,
               nodes_[static_cast<std::size_t>(node.left)].box.squaredExteriorDistance(x)};
    Entry far{node.right,
              nodes_[static_cast<std::size_t>(node.right)].box.squaredExteriorDistance(x)};
    if (near.bound > far.bound) std::swap(near, far);
    if (far.bound < best) stack[size++] = far;
    if (near.bound < best) stack[size++] = near;
  }
  return {std::sqrt(best), triangle};
}

double TriangleTree::winding_number(const Vector3d& x) const {
  double angle = 0;
  int stack[128];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const Node& node = nodes_[static_cast<std::size_t>(stack[--size])];
    const Vector3d r = node.centre - x;
    const double length = r.norm();
    if (length > kMinDipoleRadii * node.radius && length > 0) {
      angle += node.area_vector.dot(r) / (length * length * length);
    } else if (node.left < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        const int t = order_[static_cast<std::size_t>(i)];
        angle += solid_angle(corner(t, 0) - x, corner(t, 1) - x, corner(t, 2) - x);
      }
    } else {
      stack[size++] = node.right;
      stack[size++] = node.left;
    }
  }
  return angle / (4 * std::numbers::pi);
}

}  // namespace limber::scene::lattice
