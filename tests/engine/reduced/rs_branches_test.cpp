// Branches of the logarithm where they are hard to choose: full turns, poor meshes, inverted tets.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"
#include "engine/scene/formats/mesh_formats.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

constexpr double kTurn = 2 * 3.14159265358979323846;
using testing::block;

/// Every cross-section turned by angle_at_end * x / length about the beam's axis.
Eigen::VectorXd twisted(const bodies::ElasticBody& body, double angle_at_end) {
  const Eigen::Matrix3Xd& x = body.mesh.nodes;
  const Eigen::Vector3d low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
  Eigen::VectorXd u(3 * x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double s = (x(0, i) - low[0]) / (high[0] - low[0]);
    Eigen::Vector3d arm = x.col(i) - 0.5 * (low + high);
    arm[0] = 0;
    u.segment<3>(3 * i) =
        rotations::exponential_minus_identity(angle_at_end * s * Eigen::Vector3d::UnitX()) * arm;
  }
  return u;
}

/// g(y) = G u in every tet, and u comes back from y alone.
void expect_round_trip(const FullReconstruction& full, const Eigen::VectorXd& u,
                       const Eigen::VectorXd& y, double tolerance) {
  double worst = 0;
  for (int e = 0; e < full.gradient().tet_count(); ++e) {
    const Eigen::Matrix3d there = full.gradient().apply(u, e);
    const Eigen::Matrix3d back = displacement_gradient(y.segment<9>(9 * e));
    worst = std::max(worst, (back - there).norm() / (1 + there.norm()));
  }
  EXPECT_LT(worst, 1e-13);
  EXPECT_LT((full.from_coordinates(y) - u).norm(), tolerance * u.norm());
}

/// No tet has lost a turn. Next to a full turn only the multiples of the axis that is left exist,
/// so tets there are left out; the bar has tets between and beyond.
void expect_angles_of_twist(const bodies::ElasticBody& body, const Eigen::VectorXd& y,
                            double angle_at_end) {
  const double length = body.mesh.nodes.row(0).maxCoeff();
  int judged = 0;
  double most = 0;
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    double s = 0;
    for (int a = 0; a < 4; ++a) s += body.mesh.nodes(0, body.mesh.tets(a, e)) / (4 * length);
    const double angle = angle_at_end * s;
    const double full_turns = std::round(angle / kTurn) * kTurn;
    if (full_turns != 0 && std::abs(angle - full_turns) < 0.8) continue;
    // Sections also tilt: the axis leaves that of the bar, the angle less so.
    const double turned = std::copysign(y.segment<3>(9 * e).norm(), y[9 * e]);
    EXPECT_NEAR(turned, angle, 0.6) << "tet " << e << " at " << s << " of the length";
    most = std::max(most, std::abs(turned));
    ++judged;
  }
  EXPECT_GT(judged, body.mesh.tet_count() / 2);
  EXPECT_GT(most, std::abs(angle_at_end) - 1.6);
}

TEST(RsBranches, BeamEndTwistedByOneAndByTwoFullTurns) {
  const auto body = block(32, 3, 3, 0.1, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  for (const double turns : {1.0, 1.3, 2.0, -2.0, 2.4}) {
    const Eigen::VectorXd u = twisted(body, kTurn * turns);
    const Eigen::VectorXd y = inverse.coordinates(u);
    expect_round_trip(full, u, y, 1e-11);
    expect_angles_of_twist(body, y, kTurn * turns);
  }
}

TEST(RsBranches, TwistThatGrowsThroughTwoTurns) {
  const auto body = block(32, 3, 3, 0.1, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  RsTrack track;
  Eigen::VectorXd y = inverse.coordinates(Eigen::VectorXd::Zero(3 * body.mesh.node_count()), track);
  EXPECT_EQ(0, y.norm());
  for (int frame = 1; frame <= 50; ++frame) {
    const double angle = 0.3 * frame;
    const Eigen::VectorXd u = twisted(body, angle);
    y = inverse.coordinates(u, track);
    expect_angles_of_twist(body, y, angle);
    if (frame % 10 == 0) expect_round_trip(full, u, y, 1e-11);
  }
}

TEST(RsBranches, TumblingFreeBodyCountsItsTurns) {
  const auto body = block(3, 2, 2, 0.3, false);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 2) / 3;
  RsTrack track;
  for (int frame = 0; frame <= 40; ++frame) {
    const Eigen::Vector3d theta = 0.5 * frame * axis;  // to 20 rad, more than three turns
    const Eigen::Matrix3Xd moved =
        (rotations::exponential_minus_identity(theta) * body.mesh.nodes).colwise() +
        Eigen::Vector3d(0.1 * frame, 0, 0);
    const Eigen::VectorXd u = Eigen::Map<const Eigen::VectorXd>(moved.data(), moved.size());
    const Eigen::VectorXd y = inverse.coordinates(u, track);
    for (int e = 0; e < gradient.tet_count(); ++e) {
      ASSERT_LT((y.segment<3>(9 * e) - theta).norm(), 1e-11) << "frame " << frame;
      ASSERT_LT(y.segment<6>(9 * e + 3).norm(), 1e-12);
    }
  }
}

TEST(RsBranches, TetsTurnedInsideOut) {
  const auto body = block(6, 3, 3, 0.2, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  Random random(8);
  Eigen::VectorXd u = twisted(body, 1.0);
  for (Eigen::Index i = 0; i < u.size(); ++i) u[i] += 0.12 * random.normal();
  for (int node : body.fixed_nodes) u.segment<3>(3 * node).setZero();
  int inverted = 0;
  for (int e = 0; e < full.gradient().tet_count(); ++e) {
    const Eigen::Matrix3d f = full.gradient().apply(u, e) + Eigen::Matrix3d::Identity();
    inverted += f.determinant() < 0 ? 1 : 0;
  }
  ASSERT_GT(inverted, 20);
  expect_round_trip(full, u, inverse.coordinates(u), 1e-11);
}

/// A body of the shared data held at its lowest tenth, bent and twisted from there upwards.
void expect_round_trip_of_shared(const std::string& file) {
  const char* folder = std::getenv("LIMBER_SHARED");
  const std::filesystem::path path =
      std::filesystem::path(folder != nullptr ? folder : LIMBER_SOURCE_DIR "/../shared") / "data" /
      "bodies" / file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  bodies::TetMesh mesh = scene::read_mesh_file(path).mesh;
  mesh.materials = {bodies::Material{}};
  mesh.tet_material.assign(static_cast<std::size_t>(mesh.tet_count()), 0);
  bodies::ElasticBody body;
  body.mesh = bodies::prepare_mesh(mesh, {}).mesh;
  const Eigen::Matrix3Xd& x = body.mesh.nodes;
  const Eigen::Vector3d low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
  const double height = high[1] - low[1];
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double s = std::max(0.0, (x(1, i) - low[1]) / height - 0.1);
    if (s == 0) body.fixed_nodes.push_back(static_cast<int>(i));
    const Eigen::Vector3d theta(0.8 * s, 4 * s, 0.3 * s);
    u.segment<3>(3 * i) =
        rotations::exponential_minus_identity(theta) * (x.col(i) - 0.5 * (low + high)) +
        0.3 * height * s * s * Eigen::Vector3d::UnitX();
  }
  ASSERT_FALSE(body.fixed_nodes.empty());
  const FullReconstruction full(body);
  expect_round_trip(full, u, RsInverse(body, full.gradient()).coordinates(u), 1e-9);
}
TEST(RsBranches, SliversOfTheDolphin) { expect_round_trip_of_shared("dolphin5K.msh"); }
TEST(RsBranches, PoorMeshOfTheOctopus) { expect_round_trip_of_shared("octopus.abq"); }

}  // namespace
}  // namespace limber::reduced
