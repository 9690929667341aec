#include "tests/support/reconstruction.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "engine/base/error.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/reduced/full_reconstruction.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::random_motion;

struct Sample {
  bodies::ElasticBody body;
  ScaledModes modes;
};

const Sample& sample(bool held) {
  const auto make = [](bool at_end) {
    Sample made{testing::block(5, 2, 2, 0.1, at_end), {}};
    bodies::ModalOptions options;
    options.mode_count = 7;
    made.modes = scale_modes(made.body, bodies::modal_analysis(made.body, options));
    return made;
  };
  static const Sample with = make(true), without = make(false);
  return held ? with : without;
}

/// Some motion of the body that holds its fixed nodes: a shape of full RS per frame.
Eigen::MatrixXd base_of(const Sample& of, int frames) {
  const FullReconstruction full(of.body);
  return full.from_linear(of.modes.modes * random_motion(of.modes.count(), frames, 0.2, 8));
}

using Make = std::function<std::unique_ptr<Reconstruction>(const Sample&, const Eigen::MatrixXd&)>;

std::unique_ptr<Reconstruction> linear(const Sample& of, const Eigen::MatrixXd& base) {
  return make_linear_reconstruction(of.body, of.modes, base);
}
std::unique_ptr<Reconstruction> warped(const Sample& of, const Eigen::MatrixXd& base) {
  return make_warped_reconstruction(of.body, of.modes, base);
}
std::unique_ptr<Reconstruction> full(const Sample& of, const Eigen::MatrixXd& base) {
  return make_full_reconstruction(of.body, of.modes, base);
}

class Reconstructions : public ::testing::TestWithParam<Make> {};

void expect_consistent(Reconstruction& shapes, const Sample& of, int base_frames) {
  const int last = of.body.mesh.node_count() - 1;
  const std::vector<int> group = {last - 7, last - 3};
  const SiteId tip = shapes.add_site({last}), patch = shapes.add_site(group);
  EXPECT_EQ(tip, shapes.add_site({last}));
  const Eigen::MatrixXd z = random_motion(of.modes.count(), 4, 0.3, 3);
  const std::vector<int> frames =
      base_frames > 0 ? std::vector<int>{1, 2, 3, 4} : std::vector<int>{0, 0, 0, 0};
  const std::vector<SiteQuery> queries = {{tip, 2}, {patch, 2}, {tip, 0}, {patch, 3}};
  Eigen::Matrix3Xd u, above, below;
  Eigen::MatrixXd jacobian, unused;
  shapes.evaluate(frames, z, queries, u, &jacobian);
  ASSERT_EQ(12, jacobian.rows());
  ASSERT_EQ(z.rows(), jacobian.cols());

  // Sites are means of the shape's nodes.
  const Eigen::MatrixXd shape = shapes.displacements(1, z);
  for (int i = 0; i < 4; ++i) {
    const Eigen::VectorXd all = shape.col(queries[i].column);
    const Eigen::Vector3d expected =
        queries[i].site == tip
            ? Eigen::Vector3d(all.segment<3>(3 * last))
            : Eigen::Vector3d((all.segment<3>(3 * (last - 7)) + all.segment<3>(3 * (last - 3))) /
                              2);
    EXPECT_LT((u.col(i) - expected).norm(), 1e-12) << i;
  }
  for (int k = 0; k < z.rows(); ++k) {
    constexpr double kStep = 1e-5;
    Eigen::MatrixXd probe = z;
    probe.row(k).array() += kStep;
    shapes.evaluate(frames, probe, queries, above, nullptr);
    probe.row(k).array() -= 2 * kStep;
    shapes.evaluate(frames, probe, queries, below, nullptr);
    for (int i = 0; i < 4; ++i) {
      EXPECT_LT(
          (jacobian.col(k).segment<3>(3 * i) - (above.col(i) - below.col(i)) / (2 * kStep)).norm(),
          1e-8)
          << i << " " << k;
    }
  }
  const Eigen::MatrixXd m = random_motion(3, 4, 1, 5);
  Eigen::MatrixXd second, differences;
  shapes.curvature(frames, z, queries, m, second);
  shapes.Kinematics::curvature(frames, z, queries, m, differences);
  EXPECT_LT((second - differences).norm(), 1e-7 * std::max(1.0, differences.norm()));
}

TEST_P(Reconstructions, JacobianAndCurvatureOfAHeldBody) {
  expect_consistent(*GetParam()(sample(true), {}), sample(true), 0);
}
TEST_P(Reconstructions, JacobianAndCurvatureOfAFreeBody) {
  expect_consistent(*GetParam()(sample(false), {}), sample(false), 0);
}
TEST_P(Reconstructions, JacobianAndCurvatureOverABaseMotion) {
  for (const bool held : {true, false}) {
    const auto shapes = GetParam()(sample(held), base_of(sample(held), 6));
    expect_consistent(*shapes, sample(held), 6);
  }
}

TEST_P(Reconstructions, AtRestOverABaseMotionIsTheBaseMotion) {
  for (const bool held : {true, false}) {
    const Eigen::MatrixXd base = base_of(sample(held), 5);
    const auto shapes = GetParam()(sample(held), base);
    const Eigen::MatrixXd z = Eigen::MatrixXd::Zero(shapes->coordinate_count(), 3);
    EXPECT_LT((shapes->displacements(2, z) - base.rightCols(3)).norm(), 1e-10 * base.norm());
    EXPECT_THROW(static_cast<void>(shapes->displacements(3, z)), Error);
  }
}

TEST_P(Reconstructions, SmallPosesAreLinear) {
  for (const bool held : {true, false}) {
    const auto shapes = GetParam()(sample(held), {});
    const Eigen::MatrixXd z = random_motion(shapes->coordinate_count(), 3, 1e-5, 6);
    const Eigen::MatrixXd expected = sample(held).modes.modes * z;
    EXPECT_LT((shapes->displacements(0, z) - expected).norm(), 1e-3 * expected.norm());
  }
}

TEST_P(Reconstructions, FixedNodesStayAndBadQueriesAreRefused) {
  const Sample& of = sample(true);
  const auto shapes = GetParam()(of, {});
  const int held = of.body.fixed_nodes.front();
  EXPECT_FALSE(shapes->moves(shapes->add_site({held})));
  EXPECT_TRUE(shapes->moves(shapes->add_site({of.body.mesh.node_count() - 1})));
  const Eigen::MatrixXd z = random_motion(shapes->coordinate_count(), 1, 0.4, 7);
  EXPECT_TRUE(shapes->displacements(0, z).middleRows<3>(3 * Eigen::Index{held}).isZero(1e-14));
  EXPECT_THROW(shapes->add_site({}), Error);
  EXPECT_THROW(shapes->add_site({of.body.mesh.node_count()}), Error);
  Eigen::Matrix3Xd u;
  const int frame = 0;
  for (const SiteQuery query : {SiteQuery{9, 0}, SiteQuery{0, 1}}) {
    EXPECT_THROW(shapes->evaluate({&frame, 1}, z, {&query, 1}, u, nullptr), Error);
  }
  EXPECT_THROW(GetParam()(of, Eigen::MatrixXd::Zero(7, 2)), Error);
}

std::string name_of(const ::testing::TestParamInfo<Make>& kind) {
  static const char* const names[] = {"Linear", "Warped", "Full"};
  return names[kind.index];
}
INSTANTIATE_TEST_SUITE_P(Kinds, Reconstructions,
                         ::testing::Values(Make(linear), Make(warped), Make(full)), name_of);

// Known answer: the rigid rotation of a free body by any angle, where linear modes grow.
TEST(ModalWarping, TurnsAFreeBodyExactly) {
  const Sample& of = sample(false);
  const Eigen::Vector3d turn(0.9, -1.3, 0.4);
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(of.modes.count(), 1);
  z.col(0).segment<3>(3) = turn;
  z(1, 0) = 0.7;  // and moves it
  const Eigen::Matrix3d r = rotations::exponential(turn);
  const auto shapes = make_warped_reconstruction(of.body, of.modes);
  const auto rs = make_full_reconstruction(of.body, of.modes);
  const Eigen::VectorXd u = shapes->displacements(0, z), u_rs = rs->displacements(0, z);
  const Eigen::Matrix3Xd& x = of.body.mesh.nodes;
  const Eigen::Vector3d centre = x.rowwise().mean();  // of a block of equal cells: its middle
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector3d arm = x.col(i) - centre;
    const Eigen::Vector3d expected = r * arm - arm + Eigen::Vector3d(0, 0.7 * of.body.length(), 0);
    EXPECT_LT((u.segment<3>(3 * i) - expected).norm(), 1e-12);
    EXPECT_LT((u_rs.segment<3>(3 * i) - expected).norm(), 1e-10);
  }
}

// A bar bent far: its length is kept by warping, not by linear modes (why warping exists).
TEST(ModalWarping, KeepsTheLengthOfABentBar) {
  const Sample& of = sample(true);
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(of.modes.count(), 1);
  z(0, 0) = 0.8;
  const auto edge_stretch = [&](const Reconstruction& shapes) {
    const Eigen::VectorXd u = shapes.displacements(0, z);
    double length = 0, rest = 0;
    // Nodes along x are 9 apart, on the axis of the bar (the middle of 3 x 3).
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d edge =
          of.body.mesh.nodes.col(9 * i + 13) - of.body.mesh.nodes.col(9 * i + 4);
      const Eigen::Vector3d moved = u.segment<3>(3 * (9 * i + 13)) - u.segment<3>(3 * (9 * i + 4));
      rest += edge.norm();
      length += (edge + moved).norm();
    }
    return length / rest - 1;
  };
  EXPECT_GT(edge_stretch(*make_linear_reconstruction(of.body, of.modes)), 0.2);
  EXPECT_LT(std::abs(edge_stretch(*make_warped_reconstruction(of.body, of.modes))), 0.05);
  EXPECT_LT(std::abs(edge_stretch(*make_full_reconstruction(of.body, of.modes))), 0.05);
}

}  // namespace
}  // namespace limber::reduced
