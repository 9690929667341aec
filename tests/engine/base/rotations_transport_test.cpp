#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "engine/base/numerics/dual.h"
#include "engine/base/rotations/parallel_transport.h"

namespace limber::rotations {
namespace {

TEST(RotationsTransport, IsTheSmallestRotationBetweenTwoDirections) {
  const Eigen::Vector3d from = Eigen::Vector3d(1, 2, -0.5).normalized();
  const Eigen::Vector3d to = Eigen::Vector3d(-0.3, 1, 2).normalized();
  Eigen::Matrix3d p;
  for (int c = 0; c < 3; ++c)
    p.col(c) = parallel_transport(from, to, Eigen::Vector3d(Eigen::Vector3d::Unit(c)));
  EXPECT_LT((p * p.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_LT((p * from - to).norm(), 1e-15);
  const Eigen::AngleAxisd rotation(p);
  EXPECT_NEAR(rotation.angle(), std::acos(from.dot(to)), 1e-14);
}

TEST(RotationsTransport, StaysARotationAlmostUpToOppositeDirections) {
  const Eigen::Vector3d from(1, 0, 0), director(0, 0.6, 0.8);
  for (const double missing : {1e-2, 1e-4, 1e-6}) {
    const Eigen::Vector3d to(std::cos(std::numbers::pi - missing),
                             std::sin(std::numbers::pi - missing), 0);
    EXPECT_FALSE(are_opposite(from, to));
    const Eigen::Vector3d moved = parallel_transport(from, to, director);
    EXPECT_NEAR(moved.norm(), 1, 1e-9 * 1e-6 / missing + 1e-15) << missing;
    EXPECT_NEAR(moved.dot(to), 0, 1e-9 * 1e-6 / missing + 1e-15) << missing;
  }
  EXPECT_TRUE(are_opposite(from, Eigen::Vector3d(-1, 0, 0)));
  EXPECT_TRUE(are_opposite(from, Eigen::Vector3d(-1, 1e-9, 0)));
  EXPECT_FALSE(parallel_transport(from, Eigen::Vector3d(-1, 0, 0), director).allFinite());
}

TEST(RotationsTransport, SpinOfTheTransportedFrame) {
  using D = Dual<double>;
  // to moves on the unit sphere; omega . to of the frame is d2 . d(d1), by forward differentiation.
  const Vec3<D> from{0.6, 0.0, 0.8}, d1{0.0, 1.0, 0.0};
  Vec3<D> to{D(0.48, 0.3), D(0.64, 0.5), D(0.6, 0.0)};
  to = (1.0 / norm(to)) * to;
  const ParallelTransport<D> p(from, to);
  const Vec3<D> moved = p(d1), second = cross(to, moved);
  const double spin = second.x.value * moved.x.derivative + second.y.value * moved.y.derivative +
                      second.z.value * moved.z.derivative;
  const Vec3<D> s = p.spin();
  EXPECT_NEAR(
      spin, s.x.value * to.x.derivative + s.y.value * to.y.derivative + s.z.value * to.z.derivative,
      1e-15);
  EXPECT_GT(std::abs(spin), 1e-2);
}

}  // namespace
}  // namespace limber::rotations
