#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <vector>

#include "engine/reduced/added_poses.h"
#include "engine/reduced/reduced_model.h"
#include "engine/scene/scene.h"
#include "engine/spacetime/problem.h"

namespace limber::session {

/// How far the shapes of a motion miss keyframes.
struct KeyframeMiss {
  double distance = 0;  // largest of a node from its place in a keyframe [m]; 0 without keyframes
  /// The exact keyframe that is missed most, if by more than 2 % of the body's length. 0: none.
  std::uint64_t poor_id = 0;
  int poor_frame = 0;
  double poor_share = 0;  // of the body's length
};

/// A keyframe as the solver is asked to meet it, and what its pose has beyond the modes.
struct KeyframeTarget {
  spacetime::KeyframeConstraint constraint;
  std::shared_ptr<const reduced::PoseRest> rest;  // null: modes show the pose
};

/// Keyframes of a scene as what its solver is asked to meet: z-bar (reduced::ModalProjector), over
/// the base motion where there is one. The parts for projecting are only made for the first
/// keyframe. Driven by one thread.
class KeyframeTargets {
 public:
  /// @param scene  mesh, unit, fixed nodes, base motion; kept by reference and must outlive this
  KeyframeTargets(const scene::Scene& scene, std::shared_ptr<const reduced::ReducedModel> model);
  ~KeyframeTargets();

  /// All of them together: how a free body's pose is wound follows from the pose before. Poses of a
  /// held body stand alone: those that were there in the call before are not projected again.
  /// @returns in the order of frames
  /// @throws Error naming the keyframe whose pose has no modal coordinates
  [[nodiscard]] std::vector<KeyframeTarget> project(const std::vector<scene::Keyframe>& keyframes);

  /// @param basis  B, 3n x h; @param coordinates  q of all frames, h x N
  [[nodiscard]] KeyframeMiss miss(const std::vector<scene::Keyframe>& keyframes,
                                  const Eigen::MatrixXd& basis, const Eigen::MatrixXf& coordinates);

 private:
  struct Tools;
  using Pose = std::weak_ptr<const Eigen::VectorXd>;

  Tools& tools();
  struct Projected {
    Eigen::VectorXd coordinates;  // z-bar
    std::shared_ptr<const reduced::PoseRest> rest;
  };
  /// @param ordered  by frame
  [[nodiscard]] std::vector<Projected> project_poses(const std::vector<scene::Keyframe>& ordered);
  void project_unknown(const std::vector<scene::Keyframe>& ordered);
  /// Arguments of a single pose's z-bar: the pose and, over a base motion, the frame.
  struct Place {
    Pose pose;
    int frame;
    bool operator<(const Place& other) const {
      if (pose.owner_before(other.pose)) return true;
      return !other.pose.owner_before(pose) && frame < other.frame;
    }
  };
  [[nodiscard]] Place place(const scene::Keyframe& keyframe) const {
    return {keyframe.pose, scene_.base_motion.size() > 0 ? keyframe.frame : -1};
  }

  const scene::Scene& scene_;
  std::shared_ptr<const reduced::ReducedModel> model_;
  std::unique_ptr<Tools> tools_;
  std::map<Place, Projected> known_;  // of poses that stand alone
};

}  // namespace limber::session
