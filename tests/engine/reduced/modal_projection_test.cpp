#include "engine/reduced/modal_projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/reduced/full_reconstruction.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::reduced {
namespace {

ReducedModel small_model(const bodies::ElasticBody& body, int modes = 10) {
  ModelOptions options;
  options.mode_count = modes;
  options.basis_size = 40;
  options.cubature_size = 10;
  options.training_poses = 100;
  options.test_poses = 20;
  return build_model(body, options);
}

Eigen::MatrixXd random_poses(const ReducedModel& model, double size, int count) {
  Random random(7);
  Eigen::MatrixXd z(model.coordinate_count(), count);
  for (Eigen::Index i = 0; i < z.size(); ++i) z.data()[i] = size * random.normal();
  return z;
}

double relative(const Eigen::MatrixXd& got, const Eigen::MatrixXd& wanted) {
  return (got - wanted).norm() / wanted.norm();
}

// A pose that is a sum of modes' RS coordinates comes back; what its reconstruction does not keep
// of them is of second order, and corrections find it.
TEST(ModalProjection, PosesOfTheModelComeBack) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, held);
    const ReducedModel model = small_model(body);
    const FullReconstruction full(body);
    for (const auto tets : {ProjectionTets::kCubature, ProjectionTets::kAll}) {
      double before = 0;
      for (const double size : {0.02, 0.1}) {
        const Eigen::MatrixXd z = random_poses(model, size, 4);
        const Eigen::MatrixXd u = full.from_linear(model.modes * z);
        ProjectionOptions options;
        options.tets = tets;
        const ModalProjector plain(body, model, options);
        const double error = relative(plain.keyframes(u).z, z);
        EXPECT_LT(error, 2 * size) << held;
        EXPECT_GT(error, 2 * before);
        before = error;
        options.corrections = 40;
        const ModalProjector corrected(body, model, options);
        const ModalProjection result = corrected.motion(u);
        EXPECT_LT(relative(result.z, z), 1e-6) << held << " " << size;
        EXPECT_EQ(result.rank, model.coordinate_count() - (held ? 0 : 3));
        EXPECT_LT(result.condition, 1e3);
      }
    }
  }
}

TEST(ModalProjection, RestIsZero) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = small_model(body);
  const ModalProjection result =
      ModalProjector(body, model).keyframes(Eigen::MatrixXd::Zero(model.modes.rows(), 2));
  EXPECT_LT(result.z.norm(), 1e-12);
  EXPECT_TRUE(result.error.allFinite());
}

// The turn of a tet is the one that its neighbours and the frame before say, not the smallest.
TEST(ModalProjection, AKeyframeSequenceWithHalfTurnAndFullTurnTwists) {
  const bodies::ElasticBody body = testing::block(12, 2, 2, 0.1, true);
  const ReducedModel model = small_model(body, 12);
  Eigen::MatrixXd poses(model.modes.rows(), 4);
  const double angles[] = {0.5 * testing::kPi, testing::kPi, 2 * testing::kPi, 3 * testing::kPi};
  for (int k = 0; k < 4; ++k) poses.col(k) = testing::twist(body, angles[k]);
  const ModalProjection result = ModalProjector(body, model).keyframes(poses);
  // Twisting adds up: along the first keyframe, the others are as far as their angles say.
  const Eigen::VectorXd first = result.z.col(0);
  for (int k = 1; k < 4; ++k) {
    const double times = angles[k] / angles[0];
    EXPECT_NEAR(first.dot(result.z.col(k)) / first.squaredNorm(), times, 0.1 * times) << k;
  }
  // Twelve modes have two torsions, which is what the fit leaves.
  EXPECT_LT(result.error.maxCoeff(), 0.2);
}

TEST(ModalProjection, AFreeBodysKeyframeIsMovedAndTurned) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, false);
  const auto model = std::make_shared<const ReducedModel>(small_model(body));
  const FullReconstruction full(body);
  // Turning on by less than half a turn from pose to pose, to more than a turn in the end.
  constexpr int kPoses = 4;
  Eigen::MatrixXd poses(model->modes.rows(), kPoses);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -1).normalized(), shift(0.3, -0.2, 0.5);
  for (int k = 0; k < kPoses; ++k) {
    const Eigen::AngleAxisd turn(0.3 + 2 * k, axis);
    poses.col(k) = testing::moved(body, Eigen::VectorXd::Zero(poses.rows()),
                                  turn.toRotationMatrix(), k * shift);
  }
  const ModalProjection result = ModalProjector(body, *model).keyframes(poses);
  for (int k = 0; k < kPoses; ++k) {
    EXPECT_LT(relative(result.z.col(k).segment<3>(3), (0.3 + 2 * k) * axis), 1e-9) << k;
  }
  EXPECT_LT(relative(full.from_linear(model->modes * result.z), poses), 1e-9);
  const ReducedKinematics kinematics(model);
  Eigen::MatrixXf q;
  kinematics.coordinates(0, result.z, q);
  EXPECT_LT(relative(model->basis * q.cast<double>(), poses), 1e-4);
}

// Poses of a held body are projected side by side, and each comes out as it does alone.
TEST(ModalProjection, KeyframesOfAHeldBodyAreIndependent) {
  const bodies::ElasticBody body = testing::block(8, 2, 2, 0.1, true);
  const ReducedModel model = small_model(body, 12);
  constexpr int kPoses = 21;
  Eigen::MatrixXd poses(model.modes.rows(), kPoses);
  for (int k = 0; k < kPoses; ++k) poses.col(k) = testing::twist(body, 0.4 * k);
  const ModalProjector projector(body, model);
  EXPECT_TRUE(projector.keyframes_are_independent());
  const ModalProjection together = projector.keyframes(poses);
  for (int k = 0; k < kPoses; ++k) {
    const ModalProjection alone = projector.keyframes(poses.col(k));
    EXPECT_EQ(together.z.col(k), alone.z.col(0)) << k;
    EXPECT_EQ(together.error[k], alone.error[0]) << k;
  }
  EXPECT_GT(together.z.colwise().norm().maxCoeff(), 1);
  const bodies::ElasticBody free_body = testing::block(6, 3, 2, 0.1, false);
  EXPECT_FALSE(ModalProjector(free_body, small_model(free_body)).keyframes_are_independent());
}

TEST(ModalProjection, KeyframesOverAMovingBaseAreWhatIsAdded) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, held);
    const auto model = std::make_shared<const ReducedModel>(small_model(body));
    const FullReconstruction full(body);
    constexpr int kFrames = 8;
    const Eigen::VectorXd to = random_poses(*model, 0.1, 1);
    Eigen::MatrixXd motion(to.size(), kFrames);
    for (int f = 0; f < kFrames; ++f) motion.col(f) = to * (f + 1.0) / kFrames;
    const KeyframesOnBase keyframes{{2, 6}, full.from_linear(model->modes * motion)};
    const auto base =
        std::make_shared<const BaseMotion>(base_motion(body, *model, keyframes.base_motion));
    const ReducedKinematics kinematics(model, base);
    Eigen::MatrixXd added = 0.3 * random_poses(*model, 0.1, 2);
    Eigen::MatrixXd poses(model->modes.rows(), 2);
    for (int k = 0; k < 2; ++k) {
      Eigen::MatrixXf q;
      kinematics.coordinates(keyframes.frames[static_cast<std::size_t>(k)], added.col(k), q);
      poses.col(k) = model->basis * q.col(0).cast<double>();
    }
    const ModalProjector projector(body, *model);
    const ModalProjection result = projector.keyframes(poses, keyframes);
    EXPECT_LT(relative(result.z, added), 0.15) << held;
    // What the base motion does itself is nothing to add.
    Eigen::MatrixXd own(poses.rows(), 2);
    own << keyframes.base_motion.col(2), keyframes.base_motion.col(6);
    EXPECT_LT(projector.keyframes(own, keyframes).z.norm(), 1e-9);
  }
}

// Next to a full turn, turns counted from the fixed nodes alone may differ from the base motion's.
TEST(ModalProjection, ABaseThatIsTwistedRoundNeedsNothingForItsOwnPoses) {
  for (const int width : {1, 2, 4}) {
    const bodies::ElasticBody body = testing::block(12, width, width, 0.1, true);
    const ReducedModel model = small_model(body, 12);
    constexpr int kFrames = 25;
    KeyframesOnBase keyframes{{6, 12, 22, 23, 24}, Eigen::MatrixXd(model.modes.rows(), kFrames)};
    for (int f = 0; f < kFrames; ++f)
      keyframes.base_motion.col(f) = testing::twist(body, 4 * testing::kPi * f / (kFrames - 1));
    Eigen::MatrixXd own(model.modes.rows(), 5);
    for (int k = 0; k < 5; ++k)
      own.col(k) = keyframes.base_motion.col(keyframes.frames[static_cast<std::size_t>(k)]);
    const ModalProjector projector(body, model);
    EXPECT_LT(projector.keyframes(own, keyframes).z.norm(), 1e-9) << width;
    // Untwisted, the last takes back all of the twist.
    own.col(4).setZero();
    const ModalProjection back = projector.keyframes(own, keyframes);
    const Eigen::VectorXd half = projector.keyframes(testing::twist(body, testing::kPi)).z;
    EXPECT_NEAR(half.dot(back.z.col(4)) / half.squaredNorm(), -4, 0.8) << width;
  }
}

TEST(ModalProjection, OverABaseTurnsContinueFromTheBase) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, false);
  const ReducedModel model = small_model(body);
  // The base spins by three turns; the keyframe is a little ahead of it.
  constexpr int kFrames = 13;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(model.modes.rows());
  KeyframesOnBase keyframes{{kFrames - 1}, Eigen::MatrixXd(rest.size(), kFrames)};
  const auto spun = [&](double angle) {
    const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitY());
    return testing::moved(body, rest, turn.toRotationMatrix(), Eigen::Vector3d(0.1, 0, 0));
  };
  const double step = 6.2 * testing::kPi / (kFrames - 1);
  for (int f = 0; f < kFrames; ++f) keyframes.base_motion.col(f) = spun(step * f);
  const Eigen::MatrixXd pose = spun(step * (kFrames - 1) + 0.4);
  const ModalProjection result = ModalProjector(body, model).keyframes(pose, keyframes);
  EXPECT_LT((result.z.col(0).segment<3>(3) - Eigen::Vector3d(0, 0.4, 0)).norm(), 1e-9);
}

void expect_refused(ErrorCode code, const std::string& field, const std::function<void()>& call) {
  try {
    call();
    FAIL() << field;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_EQ(error.field(), field) << error.what();
  }
}

TEST(ModalProjection, BadInputNamesItsField) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = small_model(body);
  const ModalProjector projector(body, model);
  const Eigen::MatrixXd good = Eigen::MatrixXd::Zero(model.modes.rows(), 3);
  const auto bad = ErrorCode::kInvalidArgument;
  expect_refused(bad, "poses", [&] { (void)projector.keyframes(good.topRows(12)); });
  Eigen::MatrixXd nan = good;
  nan(3, 1) = std::numeric_limits<double>::quiet_NaN();
  expect_refused(bad, "poses[1]", [&] { (void)projector.keyframes(nan); });
  expect_refused(bad, "base_motion", [&] {
    (void)projector.keyframes(good, {{0, 1, 2}, good.topRows(9)});
  });
  expect_refused(bad, "base_motion[1]", [&] { (void)projector.keyframes(good, {{0, 1, 2}, nan}); });
  expect_refused(bad, "frames", [&] { (void)projector.keyframes(good, {{0, 1}, good}); });
  expect_refused(bad, "frames[1]", [&] { (void)projector.keyframes(good, {{0, 0, 1}, good}); });
  expect_refused(ErrorCode::kOutOfRange, "frames[2]", [&] {
    (void)projector.keyframes(good, {{0, 1, 3}, good});
  });
  const bodies::ElasticBody other = testing::block(5, 2, 2, 0.1, true);
  expect_refused(bad, "body", [&] { const ModalProjector wrong(other, model); });
  ProjectionOptions options;
  options.rank_tolerance = 1;
  expect_refused(bad, "rank_tolerance", [&] { options.validate(); });
  options = {};
  options.corrections = -1;
  expect_refused(bad, "corrections", [&] { const ModalProjector wrong(body, model, options); });
}

TEST(ModalProjection, StopsOnRequest) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = small_model(body);
  const JobContext job;
  job.cancellation.request();
  expect_refused(ErrorCode::kCancelled, "", [&] {
    (void)ModalProjector(body, model).keyframes(Eigen::MatrixXd::Zero(model.modes.rows(), 2), job);
  });
}

}  // namespace
}  // namespace limber::reduced
