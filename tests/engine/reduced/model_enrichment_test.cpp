#include "engine/reduced/model_enrichment.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/reduced/cubature.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

/// A model that is made small on purpose.
ReducedModel coarse_model(const bodies::ElasticBody& body) {
  ModelOptions options;
  options.mode_count = 10;
  options.basis_size = body.is_free() ? 30 : 16;
  options.cubature_size = 5;
  options.training_poses = 200;
  options.test_poses = 20;
  return build_model(body, options);
}

/// A swing that no training pose is like: along one direction of modal space, twice as far.
Eigen::MatrixXd swing(const ReducedModel& model, int frames) {
  Eigen::VectorXd to = Eigen::VectorXd::Zero(model.coordinate_count());
  to[model.rigid_count] = 0.7;
  to[model.rigid_count + 1] = -0.4;
  to[model.rigid_count + 3] = 0.3;
  Eigen::MatrixXd z(to.size(), frames);
  for (int i = 0; i < frames; ++i) z.col(i) = to * std::sin(0.3 + 2.0 * i / frames);
  return z;
}

double rms(const ReducedModel& model, const FullReconstruction& full, const Eigen::MatrixXd& z) {
  const Eigen::MatrixXd u = full.from_linear(model.modes * z);
  const Eigen::MatrixXd shown =
      model.basis * reduced_coordinates(model.rs_modes, model.map, model.direct, z);
  return (shown - u).norm() / u.norm();
}

TEST(ModelEnrichment, LearnsTheFramesOfAMotion) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  const Eigen::MatrixXd z = swing(model, 24);
  EnrichmentOptions options;
  options.tolerance = 0.002;
  const EnrichedModel enriched = enrich_model(body, model, full, z, options);
  const EnrichmentReport& report = enriched.report;
  EXPECT_NEAR(report.error_before, rms(model, full, z), 1e-10);
  EXPECT_NEAR(report.error_after, rms(enriched.model, full, z), 1e-10);
  EXPECT_GT(report.error_before, 0.01);
  EXPECT_LT(report.error_after, 0.1 * report.error_before);
  EXPECT_LE(report.basis_error, 0.3 * options.tolerance);
  EXPECT_LE(report.kept_after, 1.25 * report.kept_before + 1e-12);
  EXPECT_GT(report.columns, 0);
  EXPECT_EQ(report.tets, options.tets);
  EXPECT_EQ(enriched.model.basis_size(), model.basis_size() + report.columns);
  EXPECT_EQ(enriched.model.cubature_size(), model.cubature_size() + report.tets);
  // Frames between the learnt ones, and farther ones.
  const Eigen::MatrixXd between = swing(model, 37);
  EXPECT_LT(rms(enriched.model, full, between), 0.15 * rms(model, full, between));
  EXPECT_LT(rms(enriched.model, full, 1.2 * between), 0.3 * rms(model, full, 1.2 * between));
}

TEST(ModelEnrichment, KeepsWhatIsThere) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  const EnrichedModel enriched = enrich_model(body, model, full, swing(model, 12), {});
  const Eigen::Index columns = model.basis.cols();
  EXPECT_EQ(enriched.model.basis.leftCols(columns), model.basis);
  EXPECT_EQ(enriched.model.modes, model.modes);
  EXPECT_EQ(enriched.model.rs_modes.topRows(model.rs_modes.rows()), model.rs_modes);
  const Eigen::MatrixXd& basis = enriched.model.basis;
  EXPECT_LT((basis.transpose() * basis - Eigen::MatrixXd::Identity(basis.cols(), basis.cols()))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  // Right to first order: small poses stay exact whatever was learnt.
  const Eigen::MatrixXd small = 1e-4 * swing(model, 12);
  EXPECT_LT(rms(enriched.model, full, small), 2 * rms(model, full, small) + 1e-6);
}

TEST(ModelEnrichment, TurnsOfAFreeBodyStayExact) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, false);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  const EnrichedModel enriched = enrich_model(body, model, full, swing(model, 12), {});
  EXPECT_LT(enriched.report.error_after, 0.5 * enriched.report.error_before);
  Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(model.coordinate_count(), 2);
  turn.col(0).segment<3>(3) = Eigen::Vector3d(0.4, -1.1, 0.8);
  turn.col(1).segment<3>(3) = Eigen::Vector3d(2, 0.5, -1);
  EXPECT_LT(rms(model, full, turn), 1e-9);
  EXPECT_LT(rms(enriched.model, full, turn), 1e-9);
}

TEST(ModelEnrichment, OfOneFrame) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  const Eigen::MatrixXd z = swing(model, 5).col(2);
  const EnrichedModel enriched = enrich_model(body, model, full, z, {});
  EXPECT_LT(enriched.report.error_after, 0.3 * enriched.report.error_before);
}

TEST(ModelEnrichment, AFrameAtRestTeachesNothing) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(model.coordinate_count(), 3);
  const EnrichedModel enriched = enrich_model(body, model, full, rest, {});
  EXPECT_EQ(enriched.report.columns, 0);
  EXPECT_EQ(enriched.report.error_before, 0);
  EXPECT_EQ(enriched.report.error_after, 0);
  EXPECT_TRUE(enriched.model.map.allFinite());
}

TEST(ModelEnrichment, DoesNotDependOnThreads) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, true);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  const int before = thread_count();
  set_thread_count(1);
  const EnrichedModel alone = enrich_model(body, model, full, swing(model, 8), {});
  set_thread_count(3);
  const EnrichedModel several = enrich_model(body, model, full, swing(model, 8), {});
  set_thread_count(before);
  EXPECT_EQ(alone.model.map, several.model.map);
  EXPECT_EQ(alone.model.basis, several.model.basis);
  EXPECT_EQ(alone.model.tets, several.model.tets);
}

TEST(ModelEnrichment, CanBeCancelledAndRefusesWhatMakesNoSense) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = coarse_model(body);
  const FullReconstruction full(body);
  Cancellation cancellation;
  cancellation.request();
  const auto code_of = [&](const Eigen::MatrixXd& z, const EnrichmentOptions& options,
                           const JobContext& job) {
    try {
      static_cast<void>(enrich_model(body, model, full, z, options, job));
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::kInternal;
  };
  EXPECT_EQ(code_of(swing(model, 3), {}, {cancellation, {}}), ErrorCode::kCancelled);
  EXPECT_EQ(code_of(Eigen::MatrixXd::Zero(3, 2), {}, {}), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(swing(model, 0), {}, {}), ErrorCode::kInvalidArgument);
  EnrichmentOptions options;
  options.tolerance = 0;
  EXPECT_EQ(code_of(swing(model, 3), options, {}), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace limber::reduced
