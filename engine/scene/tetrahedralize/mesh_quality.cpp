#include "engine/scene/tetrahedralize/mesh_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace limber::scene {

using Eigen::Vector3d;

namespace {

/// Smallest and largest dihedral angle of a tet [degrees].
std::pair<double, double> dihedral_range(const Vector3d (&p)[4]) {
  double smallest = 180, largest = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      // The dihedral angle at edge ij is the angle between the other two corners seen along the
      // edge.
      int others[2], count = 0;
      for (int corner = 0; corner < 4; ++corner) {
        if (corner != i && corner != j) others[count++] = corner;
      }
      const Vector3d edge = (p[j] - p[i]).normalized();
      const Vector3d u = (p[others[0]] - p[i]) - (p[others[0]] - p[i]).dot(edge) * edge;
      const Vector3d v = (p[others[1]] - p[i]) - (p[others[1]] - p[i]).dot(edge) * edge;
      const double angle = std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi;
      smallest = std::min(smallest, angle);
      largest = std::max(largest, angle);
    }
  }
  return {smallest, largest};
}

}  // namespace

double mean_ratio(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d ab = b - a, ac = c - a, ad = d - a;
  const double six_volumes = ab.cross(ac).dot(ad);
  const double squares = ab.squaredNorm() + ac.squaredNorm() + ad.squaredNorm() +
                         (c - b).squaredNorm() + (d - b).squaredNorm() + (d - c).squaredNorm();
  if (!(squares > 0)) return 0;
  const double size = 12 * std::cbrt(0.25 * six_volumes * six_volumes) / squares;
  return six_volumes >= 0 ? size : -size;
}

double tet_shape(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  constexpr double kMinMeanRatio = 0.3, kMinDihedralDeg = 10, kMaxDihedralDeg = 165;
  const double ratio = mean_ratio(a, b, c, d) / kMinMeanRatio;
  if (!(ratio > 0)) return ratio;
  const auto [smallest, largest] = dihedral_range({a, b, c, d});
  return std::min({ratio, smallest / kMinDihedralDeg, (180 - largest) / (180 - kMaxDihedralDeg)});
}

MeshQuality measure_quality(const bodies::TetMesh& mesh) {
  MeshQuality quality;
  if (mesh.tet_count() == 0) return quality;
  quality.min_mean_ratio = std::numeric_limits<double>::infinity();
  quality.min_dihedral_deg = 180;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    Vector3d p[4];
    for (int corner = 0; corner < 4; ++corner) p[corner] = mesh.nodes.col(mesh.tets(corner, t));
    const double ratio = mean_ratio(p[0], p[1], p[2], p[3]);
    quality.min_mean_ratio = std::min(quality.min_mean_ratio, ratio);
    quality.average_mean_ratio += ratio / mesh.tet_count();
    const auto [smallest, largest] = dihedral_range(p);
    quality.min_dihedral_deg = std::min(quality.min_dihedral_deg, smallest);
    quality.max_dihedral_deg = std::max(quality.max_dihedral_deg, largest);
  }
  return quality;
}

}  // namespace limber::scene
