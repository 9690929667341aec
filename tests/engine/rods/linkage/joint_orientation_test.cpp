#include "engine/rods/linkage/joint_orientation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace limber::rods::detail {
namespace {

constexpr double kPi = std::numbers::pi;

/// Joints of a grid over a surface, with which rod of a joint comes first and which way its
/// tangents point as a number says.
struct JointGrid {
  std::vector<RodPair> pairs;
  std::vector<JointLink> links;
  std::vector<JointPlace> places;
  std::vector<int> along;  // of each joint: which of its rods goes along the columns

  using Surface = std::function<Eigen::Vector3d(double, double)>;

  JointGrid(int columns, int rows, const Surface& surface, unsigned seed = 0) {
    constexpr double kStep = 1e-5;
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        seed = seed * 1664525u + 1013904223u;
        const bool swapped = seed >> 31 != 0;
        const double sign = (seed >> 30 & 1) != 0 ? 1 : -1;
        const Eigen::Vector3d u = surface(c + kStep, r) - surface(c - kStep, r);
        const Eigen::Vector3d v = surface(c, r + kStep) - surface(c, r - kStep);
        RodPair pair;
        pair.tangents[swapped ? 1 : 0] = sign * u.normalized();
        pair.tangents[swapped ? 0 : 1] = v.normalized();
        pairs.push_back(pair);
        along.push_back(swapped ? 1 : 0);
        const int joint = static_cast<int>(places.size());
        places.push_back({100 + joint, joint, surface(c, r)});
      }
    }
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        if (c + 1 < columns) link(r * columns + c, r * columns + c + 1, true);
        if (r + 1 < rows) link(r * columns + c, (r + 1) * columns + c, false);
      }
    }
  }
  void link(int a, int b, bool is_along) {
    const auto rod = [&](int joint) {
      const int first = along[static_cast<std::size_t>(joint)];
      return is_along ? first : 1 - first;
    };
    links.push_back({static_cast<int>(links.size()),
                     {a, b},
                     {rod(a), rod(b)},
                     (places[static_cast<std::size_t>(b)].position -
                      places[static_cast<std::size_t>(a)].position)
                         .normalized()});
  }
  [[nodiscard]] JointOrientations orient() const { return orient_joints(pairs, links, places); }
};

/// Normals and angles fit the tangents, and letters go along the rods.
void expect_agreement(const JointGrid& grid, const JointOrientations& found) {
  for (std::size_t j = 0; j < grid.pairs.size(); ++j) {
    const auto& tangents = grid.pairs[j].tangents;
    const Eigen::Vector3d a = tangents[static_cast<std::size_t>(found.rod_a[j])];
    const Eigen::Vector3d b = tangents[static_cast<std::size_t>(1 - found.rod_a[j])];
    EXPECT_NEAR(found.normals[j].norm(), 1, 1e-12);
    EXPECT_NEAR(found.normals[j].dot(a), 0, 1e-9);
    const Eigen::Vector3d turned = Eigen::AngleAxisd(found.angles[j], found.normals[j]) * a;
    EXPECT_LE((turned - found.signs_b[j] * b).norm(), 1e-9) << "joint " << j;
  }
  for (const JointLink& link : grid.links) {
    const auto is_a = [&](int end) {
      const auto e = static_cast<std::size_t>(end);
      return link.rods[e] == found.rod_a[static_cast<std::size_t>(link.joints[e])];
    };
    EXPECT_EQ(is_a(0), is_a(1)) << "segment " << link.segment;
  }
}

Eigen::Vector3d sheared_plane(double c, double r) {
  return {c + r * std::cos(1.1), r * std::sin(1.1), 0};
}

TEST(JointOrientation, OfAFlatGridPointsUpWithAcuteAngles) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    const JointGrid grid(3, 4, sheared_plane, seed);
    const JointOrientations found = grid.orient();
    expect_agreement(grid, found);
    for (std::size_t j = 0; j < grid.pairs.size(); ++j) {
      EXPECT_NEAR(found.normals[j].z(), 1, 1e-9);
      EXPECT_NEAR(found.angles[j], 1.1, 1e-9);
    }
  }
}

/// A grid that is drawn from below, or lies in another plane, has the same sides.
TEST(JointOrientation, WithoutUpAndDownTheOtherAxesDecide) {
  const JointGrid grid(
      3, 3, [](double c, double r) { return Eigen::Vector3d(0, -r, c); }, 5);
  const JointOrientations found = grid.orient();
  expect_agreement(grid, found);
  for (const Eigen::Vector3d& normal : found.normals) EXPECT_NEAR(normal.x(), 1, 1e-9);
}

TEST(JointOrientation, OfAClosedTubePointsOutwards) {
  constexpr int kColumns = 12;
  const auto tube = [](double c, double r) {
    const double angle = 2 * kPi * c / kColumns;
    return Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.4 * r);
  };
  for (const unsigned seed : {1u, 2u, 3u}) {
    JointGrid grid(kColumns, 3, tube, seed);
    for (int r = 0; r < 3; ++r) grid.link(r * kColumns + kColumns - 1, r * kColumns, true);
    const JointOrientations found = grid.orient();
    expect_agreement(grid, found);
    for (std::size_t j = 0; j < grid.places.size(); ++j) {
      Eigen::Vector3d outward = grid.places[j].position;
      outward.z() = 0;
      EXPECT_GT(found.normals[j].dot(outward), 0.99);
    }
  }
}

/// A band around a circle that turns over by so many halves of a turn.
JointGrid twisted_band(int halves) {
  constexpr int kColumns = 24;
  JointGrid grid(kColumns, 2, [halves](double c, double r) {
    const double angle = 2 * kPi * c / kColumns, twist = halves * angle / 2;
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
    return Eigen::Vector3d(
        3 * out +
        0.3 * (r - 0.5) * (std::cos(twist) * out + std::sin(twist) * Eigen::Vector3d::UnitZ()));
  });
  for (const int r : {0, 1})
    grid.link(r * kColumns + kColumns - 1, (halves % 2 == 0 ? r : 1 - r) * kColumns, true);
  return grid;
}

TEST(JointOrientation, AMoebiusBandIsRefusedByItsLoop) {
  for (const int halves : {1, 3}) {
    try {
      (void)twisted_band(halves).orient();
      ADD_FAILURE() << "a band with one side was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      EXPECT_EQ(error.field().find("vertices[1"), 0u) << error.field();
      EXPECT_NE(std::string(error.what()).find("one side only"), std::string::npos);
    }
  }
}

TEST(JointOrientation, ABandWithAWholeTurnHasTwoSides) {
  const JointGrid grid = twisted_band(2);
  expect_agreement(grid, grid.orient());
}

/// Rods that nearly lie on each other have no normal of their own.
TEST(JointOrientation, AClosedJointTakesTheNormalOfItsNeighbours) {
  JointGrid grid(3, 3, sheared_plane, 3);
  grid.pairs[4].tangents[1] = grid.pairs[4].tangents[0];
  const JointOrientations found = grid.orient();
  EXPECT_NEAR(found.normals[4].z(), 1, 1e-9);
  EXPECT_NEAR(std::abs(std::sin(found.angles[4])), 0, 1e-9);
}

TEST(JointOrientation, ALoneJointIsNoSpecialCase) {
  JointGrid grid(1, 1, sheared_plane);
  const JointOrientations found = grid.orient();
  expect_agreement(grid, found);
  EXPECT_NEAR(found.normals[0].z(), 1, 1e-9);
}

}  // namespace
}  // namespace limber::rods::detail
