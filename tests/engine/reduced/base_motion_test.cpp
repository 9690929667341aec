#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::reduced {
namespace {

ModelOptions moving_base_options() {
  ModelOptions options;
  options.mode_count = 10;
  options.basis_size = 40;
  options.cubature_size = 10;
  options.training_poses = 150;
  options.test_poses = 40;
  return options;
}

// With z = 0 the model gives back the base motion as B sees it.
TEST(BaseMotion, RestOfTheEditIsTheBaseMotion) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, held);
    const auto model =
        std::make_shared<const ReducedModel>(build_model(body, moving_base_options()));
    const FullReconstruction full(body);
    constexpr int kFrames = 12;
    Random random(4);
    Eigen::VectorXd to = Eigen::VectorXd::Zero(model->coordinate_count());
    for (Eigen::Index k = 0; k < to.size(); ++k) to[k] = 0.15 * random.normal();
    Eigen::MatrixXd z(to.size(), kFrames);
    for (int f = 0; f < kFrames; ++f) z.col(f) = to * (f + 1.0) / kFrames;
    const Eigen::MatrixXd u = full.from_linear(model->modes * z);
    const auto base = std::make_shared<const BaseMotion>(base_motion(body, *model, u));
    const ReducedKinematics kinematics(model, base);
    Eigen::MatrixXf q;
    kinematics.coordinates(0, Eigen::MatrixXd::Zero(to.size(), kFrames), q);
    ASSERT_EQ(kFrames, q.cols());
    for (int f = 0; f < kFrames; ++f) {
      const Eigen::VectorXd got = model->basis * q.col(f).cast<double>();
      const Eigen::VectorXd seen = model->basis * (model->basis.transpose() * u.col(f));
      EXPECT_LT((got - seen).norm(), 1e-5 * seen.norm()) << held << " " << f;
      EXPECT_LT((got - u.col(f)).norm(), 3 * model->report.error_mean * u.col(f).norm())
          << held << " " << f;
    }
  }
}

Eigen::VectorXd small_pose(const ReducedModel& model, double size, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd z(model.coordinate_count());
  for (Eigen::Index k = 0; k < z.size(); ++k) z[k] = size * random.normal();
  return z;
}

// The edit adds to the RS coordinates of the base motion (section 6.1): y = y_base + Q W-hat z,
// reconstructed in full.
TEST(BaseMotion, EditsAddToItsRsCoordinates) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, held);
    const auto model =
        std::make_shared<const ReducedModel>(build_model(body, moving_base_options()));
    const FullReconstruction full(body);
    const RsInverse inverse(body, full.gradient());
    constexpr int kFrames = 6;
    const Eigen::VectorXd to = small_pose(*model, 0.12, 4), edit = small_pose(*model, 0.12, 5);
    Eigen::MatrixXd z(to.size(), kFrames), edits(to.size(), kFrames);
    for (int f = 0; f < kFrames; ++f) {
      z.col(f) = to * (f + 1.0) / kFrames;
      edits.col(f) = edit * (f + 1.0) / kFrames;
    }
    const Eigen::MatrixXd u = full.from_linear(model->modes * z);
    const ReducedKinematics kinematics(
        model, std::make_shared<const BaseMotion>(base_motion(body, *model, u)));
    Eigen::MatrixXf q;
    kinematics.coordinates(0, edits, q);
    RsTrack track;
    for (int f = 0; f < kFrames; ++f) {
      const Eigen::VectorXd y = inverse.coordinates(u.col(f), track);
      const Eigen::VectorXd linear = model->modes * edits.col(f);
      Eigen::VectorXd expected =
          full.from_coordinates(y + linear_coordinates(full.gradient(), linear));
      if (!held) {
        // RS coordinates do not see translations: those of base and edit add up.
        const Eigen::VectorXd mass = bodies::lumped_node_mass(body.mesh);
        const Eigen::Vector3d shift =
            testing::by_node(Eigen::VectorXd(u.col(f) + linear)) * mass / mass.sum() -
            testing::by_node(expected) * mass / mass.sum();
        for (Eigen::Index i = 0; i < expected.size(); ++i) expected[i] += shift[i % 3];
      }
      const Eigen::VectorXd got = model->basis * q.col(f).cast<double>();
      const double size = (expected - u.col(f)).norm();
      EXPECT_LT((got - expected).norm(), 4 * model->report.error_mean * expected.norm())
          << held << " " << f << ": edit " << size << " of " << expected.norm() << ", error "
          << (got - expected).norm();
      EXPECT_GT(size, 0.3 * expected.norm());
    }
  }
}

/// What is seen of a spinning bar's two far corners, 6 x frames.
struct Spin {
  Eigen::MatrixXd base;     // at z = 0 [m]
  Eigen::MatrixXd offsets;  // added by a small z that stays
};

Spin spin(const bodies::ElasticBody& body, const std::shared_ptr<const ReducedModel>& model,
          const std::shared_ptr<const BaseMotion>& base) {
  ReducedKinematics kinematics(model, base);
  const SiteId sites[] = {kinematics.add_site({0}),
                          kinematics.add_site({body.mesh.node_count() - 1})};
  std::vector<SiteQuery> queries;
  std::vector<int> frames;
  for (int f = 0; f < base->rs.cols(); ++f) {
    frames.push_back(f);
    for (const SiteId site : sites) queries.push_back({site, f});
  }
  const Eigen::MatrixXd edit = small_pose(*model, 0.01, 6).replicate(1, base->rs.cols());
  Eigen::Matrix3Xd before, after;
  kinematics.evaluate(frames, 0 * edit, queries, before, nullptr);
  kinematics.evaluate(frames, edit, queries, after, nullptr);
  const Eigen::Matrix3Xd added = after - before;
  return {Eigen::Map<const Eigen::MatrixXd>(before.data(), 6, edit.cols()),
          Eigen::Map<const Eigen::MatrixXd>(added.data(), 6, edit.cols())};
}

/// Largest second difference in time of offsets, over the largest offset: within 1 rad of a full
/// turn, and elsewhere.
std::array<double, 2> roughness(const Eigen::MatrixXd& offsets, double step) {
  std::array<double, 2> result = {0, 0};
  for (Eigen::Index f = 1; f + 1 < offsets.cols(); ++f) {
    const double angle = step * static_cast<double>(f);
    const bool at_full_turn = angle > 4 && std::abs(std::remainder(angle, 2 * testing::kPi)) < 1;
    double& worst = result[at_full_turn ? 0 : 1];
    worst = std::max(worst, (offsets.col(f + 1) - 2 * offsets.col(f) + offsets.col(f - 1)).norm());
  }
  const double most = offsets.colwise().norm().maxCoeff();
  return {result[0] / most, result[1] / most};
}

// What an offset's rotation across theta adds vanishes at a full turn. There theta swings through
// all directions across the spin within wobble / step frames, and at the worst between two of them;
// the branch that keeps the turns jumps by wobble / pi of the offset. Without a wobble the axis
// stays.
TEST(BaseMotion, OffsetsOfASpinningFreeBodyAreSmoothThroughFullTurns) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, false);
  const auto model = std::make_shared<const ReducedModel>(build_model(body, moving_base_options()));
  for (const double wobble : {0.0, 0.01, 0.05, 0.2}) {
    for (const double step : {0.1, 0.02, 0.01}) {
      const int frames = static_cast<int>(std::lround(14 / step));  // through 2 pi and 4 pi
      Eigen::MatrixXd u(3 * body.mesh.node_count(), frames);
      for (int f = 0; f < frames; ++f) u.col(f) = testing::spun(body, step * f, wobble);
      const auto base = std::make_shared<const BaseMotion>(base_motion(body, *model, u));
      for (int t = 0; t < model->cubature_size(); ++t) {
        EXPECT_NEAR(step * (frames - 1), base->rs(9 * t + 2, frames - 1), 2 * wobble + 1e-9);
      }
      const Spin seen = spin(body, model, base);
      const Eigen::MatrixXd projection = model->basis * (model->basis.transpose() * u);
      EXPECT_LT((seen.base.topRows(3) - projection.topRows(3)).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LT((seen.base.bottomRows(3) - projection.bottomRows(3)).cwiseAbs().maxCoeff(), 1e-9);
      const auto [at_full_turns, elsewhere] = roughness(seen.offsets, step);
      const double swing = step / wobble;  // measured: 2 swing^2, and 0.7 step^2 elsewhere
      const double wobbled =
          wobble > 0 ? std::min(2.0, wobble / testing::kPi + 3 * swing * swing) : 0;
      EXPECT_LT(at_full_turns, step * step + wobbled) << "wobble " << wobble << " step " << step;
      EXPECT_LT(elsewhere, step * step) << "wobble " << wobble << " step " << step;
    }
  }
}

TEST(BaseMotion, SaysHowFarItIsAndStops) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = build_model(body, moving_base_options());
  const Eigen::MatrixXd u = Eigen::MatrixXd::Zero(3 * body.mesh.node_count(), 100);
  JobContext job;
  int reports = 0;
  double last = 0;
  job.progress = [&](const std::string& stage, double fraction) {
    EXPECT_EQ("base motion", stage);
    EXPECT_GE(fraction, last);
    last = fraction;
    ++reports;
  };
  (void)base_motion(body, model, u, job);
  EXPECT_EQ(1, last);
  EXPECT_GT(reports, 100);
  const int before = reports;
  last = 0;
  job.progress = [&](const std::string&, double) {
    if (++reports == before + 10) job.cancellation.request();
  };
  try {
    (void)base_motion(body, model, u, job);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::kCancelled, error.code());
  }
  EXPECT_EQ(before + 10, reports);
}

TEST(BaseMotion, BadDisplacementsAreRefused) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = build_model(body, moving_base_options());
  const Eigen::Index rows = 3 * body.mesh.node_count();
  EXPECT_THROW((void)base_motion(body, model, Eigen::MatrixXd::Zero(rows - 3, 4)), Error);
  EXPECT_THROW(
      (void)base_motion(testing::block(3, 2, 2, 0.1, true), model, Eigen::MatrixXd::Zero(rows, 4)),
      Error);
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(rows, 4);
  u(5, 2) = std::nan("");
  try {
    (void)base_motion(body, model, u);
    FAIL() << "NaN was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::kInvalidArgument, error.code());
    EXPECT_EQ("base_motion[2]", error.field());
  }
}

}  // namespace
}  // namespace limber::reduced
