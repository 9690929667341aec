#include "engine/reduced/added_poses.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/full_shapes.h"
#include "engine/reduced/modal_projection.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

constexpr int kMotionFrames = 5, kPoseFrame = 3;

/// A bar whose far end is turned about its axis by `angle` [rad]; displacements from rest, 3n.
Eigen::VectorXd twist(const bodies::ElasticBody& body, double angle) {
  const Eigen::Matrix3Xd& rest = body.mesh.nodes;
  const Eigen::Vector3d middle(0, rest.row(1).mean(), rest.row(2).mean());
  Eigen::Matrix3Xd turned = rest;
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const Eigen::AngleAxisd turn(angle * rest(0, i) / rest.row(0).maxCoeff(),
                                 Eigen::Vector3d::UnitX());
    turned.col(i) = middle + turn * (rest.col(i) - middle);
  }
  return (turned - rest).reshaped();
}

struct Twisted {
  bodies::ElasticBody body = testing::block(12, 2, 2, 0.1, true);
  std::shared_ptr<const ReducedModel> model;
  Eigen::VectorXd pose;
  std::shared_ptr<const AddedPoses> added;
  Eigen::VectorXd z;

  explicit Twisted(double angle, const Eigen::MatrixXd& base = {}) : pose(twist(body, angle)) {
    ModelOptions options;
    options.mode_count = 8;
    options.basis_size = 40;
    options.cubature_size = 20;
    options.training_poses = 100;
    options.test_poses = 20;
    model = std::make_shared<const ReducedModel>(build_model(body, options));
    ProjectionOptions projection;
    projection.tets = ProjectionTets::kAll;
    projection.rest = ProjectionRest::kKept;
    const ModalProjector projector(body, *model, projection);
    const ModalProjection found = base.size() > 0 ? projector.keyframes(pose, {{kPoseFrame}, base})
                                                  : projector.keyframes(pose);
    z = found.z.col(0);
    AddedPose one;
    one.rest = std::make_shared<const PoseRest>(
        PoseRest{found.rest.col(0),
                 found.beyond.size() > 0 ? Eigen::VectorXd(found.beyond.col(0)) : Eigen::VectorXd(),
                 model->basis.transpose() * pose});
    one.frame = kPoseFrame;
    one.modal = z;
    one.share = Eigen::VectorXd{{0, 0.2, 0.6, 1, 0}};
    added = std::make_shared<const AddedPoses>(std::vector<AddedPose>{one});
  }

  [[nodiscard]] Eigen::VectorXd shape(FullShapes& shapes, int frame) const {
    return shapes.displacements({&frame, 1}, model->modes * z).col(0);
  }
};

double farthest(const Eigen::VectorXd& u) {
  return u.reshaped(3, u.size() / 3).colwise().norm().maxCoeff();
}

TEST(AddedPoses, FullShapesTakeThePoseInItsFrame) {
  for (const double turns : {0.25, 0.5, 1.0, 1.5}) {
    const Twisted twisted(2 * M_PI * turns);
    FullShapes shapes(twisted.body, twisted.model);
    const double without = farthest(twisted.shape(shapes, kPoseFrame) - twisted.pose);
    EXPECT_GT(without, 2e-3) << turns << " turns: modes do not show it";
    shapes.set_added(twisted.added);
    EXPECT_LT(farthest(twisted.shape(shapes, kPoseFrame) - twisted.pose), 1e-5) << turns;
    EXPECT_EQ(twisted.shape(shapes, 0), twisted.shape(shapes, 4)) << "nothing is added there";
  }
}

TEST(AddedPoses, OverABaseMotionTheyAreWhatThatLeavesToo) {
  const bodies::ElasticBody bar = testing::block(12, 2, 2, 0.1, true);
  Eigen::MatrixXd base(3 * bar.mesh.node_count(), kMotionFrames);
  for (int frame = 0; frame < kMotionFrames; ++frame) base.col(frame) = twist(bar, 0.3 * frame);
  const Twisted twisted(M_PI, base);
  FullShapes shapes(twisted.body, twisted.model, base);
  shapes.set_added(twisted.added);
  EXPECT_LT(farthest(twisted.shape(shapes, kPoseFrame) - twisted.pose), 1e-5);
}

TEST(AddedPoses, SitesOfTheFullMapMoveAsTheShapes) {
  const Twisted twisted(M_PI);
  FullShapes shapes(twisted.body, twisted.model);
  shapes.set_added(twisted.added);
  FullKinematics kinematics(twisted.body, twisted.model,
                            std::make_shared<const FullReconstruction>(twisted.body));
  kinematics.set_added(twisted.added);
  const int node = twisted.body.mesh.node_count() - 1;
  const SiteId site = kinematics.add_site({node});
  const int frames[] = {0, 1, 2, kPoseFrame};
  const Eigen::MatrixXd z = twisted.z.replicate(1, 4);
  const SiteQuery queries[] = {{site, 0}, {site, 1}, {site, 2}, {site, 3}};
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd jacobian, closed, differences;
  kinematics.evaluate(frames, z, queries, u, &jacobian);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d wanted = twisted.shape(shapes, frames[i]).segment<3>(3 * node);
    EXPECT_LT((u.col(i) - wanted).norm(), 1e-10) << i;
  }
  const Eigen::Matrix3Xd multipliers = testing::random_matrix(3, 4, 5);
  kinematics.curvature(frames, z, queries, multipliers, closed);
  kinematics.Kinematics::curvature(frames, z, queries, multipliers, differences);
  EXPECT_LT((closed - differences).norm(), 1e-7 * differences.norm());
}

TEST(AddedPoses, TheReducedModelShowsThePoseAsItsBasisDoes) {
  const Twisted twisted(M_PI);
  ReducedKinematics kinematics(twisted.model);
  const Eigen::MatrixXd z = twisted.z.replicate(1, kMotionFrames);
  Eigen::MatrixXf before, during, after;
  kinematics.coordinates(0, z, before);
  kinematics.set_added(twisted.added.get());
  kinematics.coordinates(0, z, during);
  const Eigen::VectorXd wanted = twisted.model->basis.transpose() * twisted.pose;
  EXPECT_LT((during.col(kPoseFrame).cast<double>() - wanted).norm(), 1e-5 * wanted.norm());
  EXPECT_GT((before.col(kPoseFrame).cast<double>() - wanted).norm(), 1e-3 * wanted.norm());
  EXPECT_LT((during.col(0) - before.col(0)).norm(), 1e-5F * before.col(0).norm());
  const SiteId site = kinematics.add_site({twisted.body.mesh.node_count() - 1});
  Eigen::Matrix3Xd u;
  const int frame = kPoseFrame;
  const SiteQuery query{site, 0};
  kinematics.evaluate({&frame, 1}, z.leftCols(1), {&query, 1}, u, nullptr);
  const Eigen::VectorXd shown = twisted.model->basis * wanted;
  EXPECT_LT((u.col(0) - shown.tail<3>()).norm(), 1e-6);
  kinematics.set_added(nullptr);
  kinematics.coordinates(0, z, after);
  EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace limber::reduced
