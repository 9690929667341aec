#include "engine/reduced/frame_projection.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/reduced/reduced_model.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::random_motion;

struct Projected {
  bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, true);
  std::shared_ptr<const ReducedModel> model;
  std::optional<FullShapes> shapes;
  std::vector<int> frames = {0, 1, 2, 3, 4, 5, 6, 7};
  Eigen::MatrixXd z;

  Projected() {
    ModelOptions options;
    options.mode_count = 8;
    options.basis_size = 8;
    options.cubature_size = 6;
    model = std::make_shared<const ReducedModel>(build_model(body, options));
    shapes.emplace(body, model, Eigen::MatrixXd());
    z = random_motion(model->coordinate_count(), 8, 0.3, 1);
  }
  [[nodiscard]] Eigen::MatrixXd full() { return shapes->displacements(frames, model->modes * z); }
  [[nodiscard]] ProjectedFrames project(const FrameProjectionOptions& options,
                                        const std::vector<HeldSite>& held = {}) {
    return project_frames(*shapes, model->basis, frames, z, held, options);
  }
  [[nodiscard]] Eigen::MatrixXd shown(const ProjectedFrames& of) const {
    Eigen::MatrixXd basis(model->basis.rows(), model->basis.cols() + of.columns.cols());
    basis << model->basis, of.columns;
    EXPECT_LT(
        (basis.transpose() * basis - Eigen::MatrixXd::Identity(basis.cols(), basis.cols())).norm(),
        1e-10);
    return basis * of.coordinates;
  }
};

TEST(FrameProjection, IsWithinItsToleranceByItsOwnAccountAndInTruth) {
  Projected projected;
  const ProjectedFrames frames = projected.project({.tolerance = 1e-3, .max_columns = 24});
  const Eigen::MatrixXd full = projected.full();
  EXPECT_GT(frames.error_before, 1e-2);
  EXPECT_LT(frames.error_after, 1e-3);
  EXPECT_GT(frames.columns.cols(), 0);
  const double truth = (projected.shown(frames) - full).norm() / full.norm();
  EXPECT_NEAR(truth, frames.error_after, 1e-9);
}

TEST(FrameProjection, WithoutNewColumnsIsTheOrthogonalProjection) {
  Projected projected;
  const ProjectedFrames frames = projected.project({.tolerance = 1e-3, .max_columns = 0});
  EXPECT_EQ(frames.columns.cols(), 0);
  const Eigen::MatrixXd expected = projected.model->basis.transpose() * projected.full();
  EXPECT_LT((frames.coordinates - expected).norm(), 1e-12);
  EXPECT_EQ(frames.error_before, frames.error_after);
}

/// A tolerance that few columns cannot meet is not met, and the error says so.
TEST(FrameProjection, SaysWhatFewColumnsLeave) {
  Projected projected;
  const ProjectedFrames frames = projected.project({.tolerance = 1e-9, .max_columns = 2});
  EXPECT_EQ(frames.columns.cols(), 2);
  EXPECT_GT(frames.error_after, 1e-9);
  EXPECT_LT(frames.error_after, frames.error_before);
}

TEST(FrameProjection, HeldSitesAreWhereTheFullShapeHasThem) {
  Projected projected;
  const int node = projected.model->node_count - 1;
  for (const Site& site : {Site{{node}, {}}, Site{{node, node - 4}, {1.3, -0.3}}}) {
    const ProjectedFrames frames = projected.project({.tolerance = 0.5, .max_columns = 0},
                                                     {{3, std::make_shared<const Site>(site)}});
    const auto left = mean_rows(projected.shown(frames) - projected.full(), site);
    EXPECT_LT(left.col(3).norm(), 1e-10);
    EXPECT_GT(left.col(4).norm(), 1e-6);
  }
}

TEST(FrameProjection, IsTheSameForAnyNumberOfThreads) {
  const auto of = [](int threads) {
    const int before = thread_count();
    set_thread_count(threads);
    Projected projected;
    ProjectedFrames frames = projected.project({});
    set_thread_count(before);
    return frames;
  };
  const ProjectedFrames one = of(1), two = of(2);
  EXPECT_EQ(one.columns, two.columns);
  EXPECT_EQ(one.coordinates, two.coordinates);
}

TEST(FrameProjection, RefusesBadOptions) {
  EXPECT_THROW((FrameProjectionOptions{0, 24}.validate()), Error);
  EXPECT_THROW((FrameProjectionOptions{1e-3, -1}.validate()), Error);
}

}  // namespace
}  // namespace limber::reduced
