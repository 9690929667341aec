#include "engine/reduced/added_poses.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {
namespace {

using Eigen::Index;

// Below it a share moves nothing that is seen: a rest is a body length at most.
constexpr double kLeastShare = 1e-7;

double square(double share) { return share * share; }

bool acts(const AddedPose& pose, int frame) { return std::abs(pose.share[frame]) > kLeastShare; }

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
    LIMBER_DEMAND(frame >= 0 && frame < pose.share.size());
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
  for (const AddedPose& pose : added.poses()) {
    const Eigen::VectorXd rest = at_cubature(model, pose.rest->coordinates);
    Eigen::VectorXd y = model.rs_modes * pose.modal + rest;
    Eigen::VectorXd missed = pose.rest->shown - model.direct * pose.modal;
    if (base != nullptr) {
      y += base->rs.col(pose.frame);
      missed -= base->direct.col(pose.frame);
    }
    missed -= mapped(model, y);
    result.rs.noalias() += rest * pose.share.transpose();
    result.direct.noalias() += missed * pose.share.transpose();
  }
  return result;
}

}  // namespace limber::reduced
