#pragma once

#include <Eigen/Core>

namespace limber::scene {

/// A motion in modal coordinates that solving begins with: an answer of before, of the same scene
/// in the same or other modes.
struct StartMotion {
  Eigen::MatrixXd coordinates;  // z, any modes x frames, finite
  /// The fitted material of this motion: S (candidates x modes) and for each mode stiffness
  /// [1/frame^2] and damping [1/frame]. Empty if none was fitted. Used if the sizes are those of
  /// the session.
  Eigen::MatrixXd mixing;
  Eigen::VectorXd stiffness, damping;
  double weight_scale = 1;  // of soft constraints, > 0
};

}  // namespace limber::scene
