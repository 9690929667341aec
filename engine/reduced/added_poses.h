#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/reduced/reduced_model.h"
#include "engine/reduced/site.h"

namespace limber::reduced {

/// The rest of a pose beyond the modes.
struct PoseRest {
  Eigen::VectorXf coordinates;  // RS coordinates of the pose less those of modes and base, 9m
  Eigen::VectorXd beyond;       // displacements that these do not have, 3n [m]; empty: none
  Eigen::VectorXd shown;        // B^T of its displacements, h [m]
};

/// A pose that joins the modes: in its frame the body takes all of it, not only what modes show.
struct AddedPose {
  std::shared_ptr<const PoseRest> rest;
  int frame = 0;          // of the motion
  Eigen::VectorXd modal;  // z-bar there, R
  Eigen::VectorXd share;  // of the rest that each frame takes, N; 1 in its own frame

  bool operator==(const AddedPose&) const = default;
};

/// y = y_base + Q W-hat z + sum of shares of rests. Parts beyond RS coordinates are added to the
/// displacements, with the squares of the shares: they are right in the pose alone.
class AddedPoses {
 public:
  explicit AddedPoses(std::vector<AddedPose> poses) : poses_(std::move(poses)) {}

  [[nodiscard]] const std::vector<AddedPose>& poses() const { return poses_; }
  [[nodiscard]] bool act_in(int frame) const;
  /// @param y  RS coordinates of all tets in a frame, 9m
  void add_to(int frame, Eigen::Ref<Eigen::VectorXd> y) const;
  /// @param u  displacements in a frame, 3n [m]
  void add_beyond(int frame, Eigen::Ref<Eigen::VectorXd> u) const;
  /// The same of a site.
  [[nodiscard]] Eigen::Vector3d beyond(int frame, const Site& site) const;

 private:
  std::vector<AddedPose> poses_;
};

/// The base motion of a reduced model with poses on top of it. In the frame of a pose with z-bar
/// the model gives the pose as B shows it.
/// @param base  null: none
[[nodiscard]] BaseMotion with_poses(const ReducedModel& model, const BaseMotion* base,
                                    const AddedPoses& added);

}  // namespace limber::reduced
