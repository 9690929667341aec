#include "engine/scene/tetrahedralize/mesh_quality.h"

#include <gtest/gtest.h>

#include <cmath>

namespace limber::scene {
namespace {

bodies::TetMesh one_tet(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  bodies::TetMesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes << a, b, c, d;
  mesh.tets.resize(4, 1);
  mesh.tets << 0, 1, 2, 3;
  return mesh;
}

TEST(MeshQuality, OfARegularTetIsOne) {
  const MeshQuality quality =
      measure_quality(one_tet({1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}));
  EXPECT_NEAR(quality.min_mean_ratio, 1, 1e-14);
  EXPECT_NEAR(quality.min_dihedral_deg, 70.528779365509308, 1e-12);
  EXPECT_NEAR(quality.max_dihedral_deg, 70.528779365509308, 1e-12);
}

TEST(MeshQuality, OfACornerTetIsKnown) {
  const MeshQuality quality = measure_quality(one_tet({0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 3}));
  // V = 27/6, edges squared 3 * 9 + 3 * 18: 12 (27/2)^(2/3) / 81
  EXPECT_NEAR(quality.average_mean_ratio, 12 * std::pow(13.5, 2.0 / 3) / 81, 1e-14);
  EXPECT_NEAR(quality.max_dihedral_deg, 90, 1e-12);
  EXPECT_NEAR(quality.min_dihedral_deg, std::acos(1 / std::sqrt(3.0)) * 180 / M_PI, 1e-12);
}

TEST(MeshQuality, OfInvertedAndFlatTetsIsNegativeAndZero) {
  EXPECT_LT(measure_quality(one_tet({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1})).min_mean_ratio,
            -0.5);
  EXPECT_EQ(measure_quality(one_tet({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0})).min_mean_ratio, 0);
  EXPECT_EQ(measure_quality(one_tet({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0})).min_mean_ratio, 0);
}

}  // namespace
}  // namespace limber::scene
