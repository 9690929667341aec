#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/support/dense.h"

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/model_file.h"
#include "engine/reduced/pose_sampling.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::reduced {
namespace {

ModelOptions build_options() {
  ModelOptions options;
  options.mode_count = 10;
  options.basis_size = 30;
  options.cubature_size = 8;
  options.training_poses = 150;
  options.test_poses = 40;
  return options;
}

/// u = B (H g(Y z) + D z), written plainly.
Eigen::VectorXd reduced_pose(const ReducedModel& model, const Eigen::VectorXd& z) {
  const Eigen::VectorXd y = model.rs_modes * z;
  Eigen::VectorXd g(y.size());
  for (Eigen::Index t = 0; t < y.size(); t += 9) {
    Eigen::Map<Eigen::Matrix3d>(g.data() + t) = displacement_gradient(y.segment<9>(t));
  }
  return model.basis * (model.map * g + model.direct * z);
}

/// Mean relative error on poses of the documented distribution that no build has seen.
double measured_error(const bodies::ElasticBody& body, const ReducedModel& model,
                      const ModelOptions& options, std::uint64_t seed) {
  const ScaledModes modes{model.eigenvalues, model.modes, model.rigid_count};
  Random random(seed);
  const Eigen::MatrixXd z =
      sample_poses(modes, body.length(), options.amplitude, PoseLevels::kTest, 60, random);
  const FullReconstruction full(body);
  const Eigen::MatrixXd u = full.from_linear(model.modes * z);
  double sum = 0;
  for (Eigen::Index s = 0; s < z.cols(); ++s) {
    sum += (reduced_pose(model, z.col(s)) - u.col(s)).norm() / u.col(s).norm();
  }
  return sum / static_cast<double>(z.cols());
}

void expect_sound(const bodies::ElasticBody& body, const ReducedModel& model,
                  const ModelOptions& options) {
  const Eigen::Index h = model.basis_size();
  EXPECT_LT((model.basis.transpose() * model.basis - Eigen::MatrixXd::Identity(h, h)).norm(),
            1e-10);
  EXPECT_TRUE(model.map.allFinite() && model.direct.allFinite() && model.rs_modes.allFinite());
  EXPECT_TRUE(std::isfinite(model.report.error_max));
  EXPECT_LE(model.report.basis_error_mean, model.report.error_mean);
  EXPECT_LE(model.report.error_mean, model.report.error_max);
  EXPECT_EQ(model.report.met_tolerance, model.report.error_mean <= options.tolerance);
  EXPECT_EQ(model.report.met_tolerance, model.report.message.empty());
  const double measured = measured_error(body, model, options, 991);
  EXPECT_NEAR(measured / model.report.error_mean, 1, 0.3);
}

TEST(BuildModel, ReportsTheErrorsOfOtherPoses) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(7, 3, 2, 0.1, held);
    const ModelOptions options = build_options();
    const ReducedModel model = build_model(body, options);
    EXPECT_EQ(held ? 10 : 16, model.coordinate_count());
    EXPECT_EQ(30, model.basis_size());
    EXPECT_EQ(8, model.cubature_size());
    expect_sound(body, model, options);
  }
}

TEST(BuildModel, WeightsAreWeightsAndFittedMapsAreBetterAtEqualCount) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  ModelOptions options = build_options();
  options.cubature_size = 15;
  const ReducedModel fitted = build_model(body, options);
  options.cubature = CubatureKind::kWeights;
  const ReducedModel weighted = build_model(body, options);
  expect_sound(body, weighted, options);
  ASSERT_EQ(15, weighted.cubature_size());
  EXPECT_LT(fitted.report.error_mean, 0.7 * weighted.report.error_mean);

  // Each block of H is a weight times P = (B^T A B)^-1 B^T G^T V (eq. 12), the weight >= 0.
  const bodies::GradientOperator gradient(body.mesh);
  const Eigen::MatrixXd fields = gradient.matrix() * weighted.basis;
  Eigen::VectorXd volume(fields.rows());
  for (Eigen::Index i = 0; i < volume.size(); ++i) volume[i] = gradient.volumes()[i / 9];
  const Eigen::MatrixXd gram = fields.transpose() * volume.asDiagonal() * fields;
  for (int t = 0; t < weighted.cubature_size(); ++t) {
    const Eigen::Index row = 9 * Eigen::Index{weighted.tets[t]};
    const Eigen::MatrixXd p =
        volume[row] * reference::solve_symmetric(gram, fields.middleRows(row, 9).transpose());
    const Eigen::MatrixXd block = weighted.map.middleCols(9 * t, 9);
    const double weight = p.cwiseProduct(block).sum() / p.squaredNorm();
    EXPECT_GE(weight, 0) << t;
    EXPECT_LT((block - weight * p).norm(), 1e-9 * block.norm()) << t;
  }
}

TEST(BuildModel, LargerBasesErrLess) {
  const bodies::ElasticBody body = testing::block(7, 3, 2, 0.1, true);
  ModelOptions options = build_options();
  double last = 1;
  for (const int h : {10, 20, 40}) {
    options.basis_size = h;
    const double error = build_model(body, options).report.basis_error_mean;
    EXPECT_LT(error, 0.8 * last) << h;
    last = error;
  }
}

TEST(BuildModel, MeetsATolerance) {
  const bodies::ElasticBody body = testing::block(7, 3, 2, 0.1, true);
  ModelOptions options = build_options();
  options.basis_size = options.cubature_size = 0;
  options.tolerance = 0.05;
  options.training_poses = 400;
  options.test_poses = 200;
  const ReducedModel model = build_model(body, options);
  EXPECT_LE(model.report.error_mean, options.tolerance) << model.report.message;
  EXPECT_TRUE(model.report.met_tolerance);
  expect_sound(body, model, options);
}

TEST(BuildModel, SaysSoWhereTheToleranceIsNotMet) {
  const bodies::ElasticBody body = testing::block(5, 2, 2, 0.1, true);
  ModelOptions options = build_options();
  options.basis_size = 5;
  options.cubature_size = 2;
  options.tolerance = 1e-4;
  const ReducedModel model = build_model(body, options);
  EXPECT_FALSE(model.report.met_tolerance);
  EXPECT_NE(std::string::npos, model.report.message.find("0.0001")) << model.report.message;
  EXPECT_EQ(5, model.basis_size());
  EXPECT_EQ(2, model.cubature_size());
}

std::string bytes_without_times(ReducedModel model) {
  model.report.modes_s = model.report.poses_s = model.report.basis_s = model.report.cubature_s = 0;
  return encode_model(model);
}

TEST(BuildModel, GivesTheSameBitsForAnyNumberOfThreads) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, true);
  for (const CubatureKind kind : {CubatureKind::kFittedMaps, CubatureKind::kWeights}) {
    ModelOptions options = build_options();
    options.cubature = kind;
    const int before = thread_count();
    set_thread_count(1);
    const std::string one = bytes_without_times(build_model(body, options));
    const std::string again = bytes_without_times(build_model(body, options));
    set_thread_count(2);
    const std::string two = bytes_without_times(build_model(body, options));
    set_thread_count(before);
    EXPECT_TRUE(one == again);
    EXPECT_TRUE(one == two);
  }
}

// z has no unit, so nothing of the reduced model but B's lengths may know of one.
TEST(BuildModel, MillimetresAndMetresGiveTheSameModel) {
  const ModelOptions options = build_options();
  const ReducedModel metres = build_model(testing::block(6, 3, 2, 0.1, true), options),
                     millimetres = build_model(testing::block(6, 3, 2, 100, true), options);
  EXPECT_EQ(metres.tets, millimetres.tets);
  EXPECT_NEAR(metres.length * 1000, millimetres.length, 1e-9);
  EXPECT_NEAR(metres.report.error_mean, millimetres.report.error_mean,
              1e-6 * metres.report.error_mean);
  Random random(3);
  Eigen::VectorXd z(metres.coordinate_count());
  for (Eigen::Index k = 0; k < z.size(); ++k) z[k] = 0.2 * random.normal();
  const Eigen::VectorXd a = reduced_pose(metres, z), b = 1e-3 * reduced_pose(millimetres, z);
  EXPECT_LT((a - b).norm(), 1e-6 * a.norm());
}

TEST(BuildModel, NearlyIncompressible) {
  bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, true);
  body.mesh.materials[0].poissons_ratio = 0.4999;
  expect_sound(body, build_model(body, build_options()), build_options());
}

TEST(BuildModel, StiffnessContrastOfEightDecades) {
  bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, true);
  body.mesh.materials.push_back({1e14, 0.4, 1000});
  for (int e = 0; e < body.mesh.tet_count() / 2; ++e) body.mesh.tet_material[e] = 1;
  expect_sound(body, build_model(body, build_options()), build_options());
}

TEST(BuildModel, StopsWhereverItIsCancelled) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  for (const char* stage : {"modes", "poses", "basis", "cubature"}) {
    JobContext job;
    const Cancellation cancellation = job.cancellation;
    double last = 0;
    job.progress = [&](const std::string& at, double fraction) {
      EXPECT_GE(fraction, last - 1e-12) << at;
      EXPECT_LE(fraction, 1) << at;
      last = fraction;
      if (at == stage) cancellation.request();
    };
    try {
      (void)build_model(body, build_options(), job);
      ADD_FAILURE() << "not cancelled at " << stage;
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::kCancelled, error.code());
    }
  }
}

TEST(BuildModel, BadOptionsAreNamed) {
  const bodies::ElasticBody body = testing::block(2, 1, 1, 0.1, true);
  const auto expect_refused = [&](const char* field, auto change) {
    ModelOptions options = build_options();
    change(options);
    try {
      (void)build_model(body, options);
      ADD_FAILURE() << field << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::kInvalidArgument, error.code()) << field;
      EXPECT_EQ(field, error.field());
    }
  };
  const double nan = std::nan("");
  expect_refused("mode_count", [](ModelOptions& o) { o.mode_count = 0; });
  expect_refused("tolerance", [](ModelOptions& o) { o.tolerance = 1e-6; });
  expect_refused("tolerance", [&](ModelOptions& o) { o.tolerance = nan; });
  expect_refused("basis_size", [](ModelOptions& o) { o.basis_size = -1; });
  expect_refused("cubature_size", [](ModelOptions& o) { o.cubature_size = -1; });
  expect_refused("training_poses", [](ModelOptions& o) { o.training_poses = 9; });
  expect_refused("training_poses", [](ModelOptions& o) { o.training_poses = -1; });
  expect_refused("test_poses", [](ModelOptions& o) { o.test_poses = 9; });
  expect_refused("amplitude", [](ModelOptions& o) { o.amplitude = 0; });
  expect_refused("amplitude", [&](ModelOptions& o) { o.amplitude = nan; });
}

// z turns a free body: full reconstructions and the model exactly, also beyond the turns of the
// training poses (1.9 rad).
TEST(BuildModel, FreeBodyTurnedByThreeRadians) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, false);
  ModelOptions options = build_options();
  options.basis_size = 60;
  options.cubature_size = 15;
  const ReducedModel model = build_model(body, options);
  const FullReconstruction full(body);
  const Eigen::VectorXd mass = bodies::lumped_node_mass(body.mesh);
  const Eigen::Vector3d centre = body.mesh.nodes * mass / mass.sum();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double angle : {1.0, 3.0, 13.0}) {
      Eigen::VectorXd z = Eigen::VectorXd::Zero(model.coordinate_count());
      z[3 + axis] = angle;
      const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::Unit(axis));
      const Eigen::VectorXd expected = testing::displacements(
          body,
          (turn.toRotationMatrix() * (body.mesh.nodes.colwise() - centre)).colwise() + centre);
      Eigen::VectorXd u;
      full.from_linear(model.modes * z, u);
      EXPECT_LT((u - expected).norm(), 1e-12 * expected.norm()) << axis << " " << angle;
      EXPECT_LT((reduced_pose(model, z) - expected).norm(), 1e-11 * expected.norm())
          << axis << " " << angle;
    }
  }
}

// A deformation on top of a turn is what is left to err. Next to full turns a tet's rotation hardly
// follows theta across the axis, of which training poses (up to 1.9 rad) know nothing.
TEST(BuildModel, DeformedFreeBodyTurnedTwice) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, false);
  ModelOptions options = build_options();
  options.basis_size = 100;
  options.cubature_size = 30;
  options.training_poses = 0;
  const ReducedModel model = build_model(body, options);
  const FullReconstruction full(body);
  const Eigen::Index elastic = model.coordinate_count() - 6;
  const auto mean_error = [&](double angle) {
    constexpr int kPoses = 20;
    Random random(5);
    double sum = 0;
    for (int s = 0; s < kPoses; ++s) {
      Eigen::VectorXd z = Eigen::VectorXd::Zero(model.coordinate_count());
      Eigen::Vector3d axis;
      for (int k = 0; k < 3; ++k) axis[k] = random.normal();
      z.segment<3>(3) = angle * axis.normalized();
      const Eigen::MatrixXd turned = full.from_linear(model.modes * Eigen::MatrixXd(z));
      for (Eigen::Index k = 0; k < elastic; ++k) z[6 + k] = random.normal();
      const double largest =
          largest_node_displacement(model.modes.rightCols(elastic) * z.tail(elastic))[0];
      z.tail(elastic) *= 0.1 * model.length / largest;
      const Eigen::MatrixXd u = full.from_linear(model.modes * Eigen::MatrixXd(z));
      sum += (reduced_pose(model, z) - u).norm() / (u - turned).norm();
    }
    return sum / kPoses;
  };
  // Relative to the deformation alone; measured 0.003, 0.016, 0.10.
  EXPECT_LT(mean_error(0), 0.006);
  EXPECT_LT(mean_error(1), 0.03);
  EXPECT_LT(mean_error(4 * testing::kPi), 0.15);
}

}  // namespace
}  // namespace limber::reduced
