#pragma once

#include <Eigen/Core>

namespace limber::scene {

/// A motion in modal coordinates that solving begins with: an answer of before, of the same scene
/// in the same or other modes.
struct StartMotion {
  Eigen::MatrixXd coordinates;  // z, any modes x frames, finite
  /// Of the material that it was found with, where one was fitted: S (candidates x modes) and for
  /// each mode stiffness [1/frame^2] and damping [1/frame]; else empty. Used where the sizes are
  /// those of the session.
  Eigen::MatrixXd mixing;
  Eigen::VectorXd stiffness, damping;
  double weight_scale = 1;  // of soft constraints, > 0
};

}  // namespace limber::scene
