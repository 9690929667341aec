#pragma once

#include <memory>
#include <vector>

#include "engine/reduced/reduced_model.h"
#include "engine/scene/scene.h"
#include "engine/spacetime/problem.h"

namespace limber::session {

/// How far the shapes of a motion miss keyframes.
struct KeyframeMiss {
  double distance = 0;  // largest of a node from its place in a keyframe [m]; 0 without keyframes
  /// The exact keyframe that is missed most, if by more than 2 % of the body's length: its pose is
  /// beyond the model's shapes. 0: none.
  std::uint64_t poor_id = 0;
  int poor_frame = 0;
  double poor_share = 0;  // of the body's length
};

/// Keyframes of a scene as what its solver is asked to meet: z-bar (reduced::ModalProjector), over
/// the base motion where there is one. What it takes to project is only made for the first
/// keyframe. Driven by one thread.
class KeyframeTargets {
 public:
  /// @param scene  mesh, unit, fixed nodes, base motion; kept by reference and must outlive this
  KeyframeTargets(const scene::Scene& scene, std::shared_ptr<const reduced::ReducedModel> model);
  ~KeyframeTargets();

  /// All of them together: how a free body's pose is wound follows from the pose before. Those of a
  /// held body that were projected before are taken as they were.
  /// @returns in the order of frames
  /// @throws Error naming the keyframe whose pose has no modal coordinates
  [[nodiscard]] std::vector<spacetime::KeyframeConstraint> project(
      const std::vector<scene::Keyframe>& keyframes);

  /// @param coordinates  q of all frames, h x N
  [[nodiscard]] KeyframeMiss miss(const std::vector<scene::Keyframe>& keyframes,
                                  const Eigen::MatrixXf& coordinates);

 private:
  struct Tools;
  Tools& tools();
  /// z-bar of poses in ascending frames, column by column.
  [[nodiscard]] Eigen::MatrixXd modal_coordinates(const std::vector<scene::Keyframe>& ordered);

  const scene::Scene& scene_;
  std::shared_ptr<const reduced::ReducedModel> model_;
  std::unique_ptr<Tools> tools_;
  /// Of a held body, whose poses do not depend on each other.
  struct Known {
    std::weak_ptr<const Eigen::VectorXd> pose;
    int frame;
    Eigen::VectorXd z;
  };
  std::vector<Known> known_;
};

}  // namespace limber::session
