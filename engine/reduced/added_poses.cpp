#include "engine/reduced/added_poses.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {
namespace {

using Eigen::Index;

// Below it a share has no visible effect: rests are some radians.
constexpr double kLeastShare = 1e-7;

double square(double share) { return share * share; }

bool acts(const AddedPose& pose, int frame) {
  LIMBER_DEMAND(frame >= 0 && frame < pose.share.size());
  return std::abs(pose.share[frame]) > kLeastShare;
}

/// Entries of the model's tets.
Eigen::VectorXd at_cubature(const ReducedModel& model, const Eigen::VectorXf& coordinates) {
  Eigen::VectorXd result(kRsSize * Index{model.cubature_size()});
  for (Index t = 0; t < model.cubature_size(); ++t) {
    result.segment<kRsSize>(kRsSize * t) =
        coordinates.segment<kRsSize>(kRsSize * Index{model.tets[static_cast<std::size_t>(t)]})
            .cast<double>();
  }
  return result;
}

/// H g(y), y of the model's tets.
Eigen::VectorXd mapped(const ReducedModel& model, const Eigen::VectorXd& y) {
  Eigen::VectorXd g(y.size());
  for (Index t = 0; t < model.cubature_size(); ++t) {
    Eigen::Map<Eigen::Matrix3d>(g.data() + kRsSize * t) =
        displacement_gradient(y.segment<kRsSize>(kRsSize * t));
  }
  return model.map * g;
}

}  // namespace

bool AddedPoses::act_in(int frame) const {
  for (const AddedPose& pose : poses_)
    if (acts(pose, frame)) return true;
  return false;
}

void AddedPoses::add_to(int frame, Eigen::Ref<Eigen::VectorXd> y) const {
  for (const AddedPose& pose : poses_) {
    if (acts(pose, frame)) y += pose.share[frame] * pose.rest->coordinates.cast<double>();
  }
}

void AddedPoses::add_beyond(int frame, Eigen::Ref<Eigen::VectorXd> u) const {
  for (const AddedPose& pose : poses_) {
    if (pose.rest->beyond.size() > 0 && acts(pose, frame))
      u += square(pose.share[frame]) * pose.rest->beyond;
  }
}

Eigen::Vector3d AddedPoses::beyond(int frame, const Site& site) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const AddedPose& pose : poses_) {
    if (pose.rest->beyond.size() > 0 && acts(pose, frame))
      sum += square(pose.share[frame]) * mean_rows(pose.rest->beyond, site);
  }
  return sum;
}

BaseMotion with_poses(const ReducedModel& model, const BaseMotion* base, const AddedPoses& added) {
  BaseMotion result;
  if (base != nullptr) {
    result = *base;
  } else if (!added.poses().empty()) {
    const Index frames = added.poses().front().share.size();
    result.rs.setZero(kRsSize * Index{model.cubature_size()}, frames);
    result.direct.setZero(model.basis_size(), frames);
  }
  const auto count = static_cast<Index>(added.poses().size());
  Eigen::MatrixXd rests(result.rs.rows(), count), missed(result.direct.rows(), count);
  Eigen::MatrixXd shares(count, result.rs.cols());
  for (Index k = 0; k < count; ++k) {
    const AddedPose& pose = added.poses()[static_cast<std::size_t>(k)];
    rests.col(k) = at_cubature(model, pose.rest->coordinates);
    shares.row(k) = pose.share;
    Eigen::VectorXd y = model.rs_modes * pose.modal + rests.col(k);
    missed.col(k) = pose.rest->shown - model.direct * pose.modal;
    if (base != nullptr) {
      y += base->rs.col(pose.frame);
      missed.col(k) -= base->direct.col(pose.frame);
    }
    missed.col(k) -= mapped(model, y);
  }
  result.rs.noalias() += rests * shares;
  result.direct.noalias() += missed * shares;
  return result;
}

}  // namespace limber::reduced
