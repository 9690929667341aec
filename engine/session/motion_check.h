#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/motion_error.h"
#include "engine/scene/scene.h"

namespace limber::session {

struct MappedBody;
struct Result;

/// What a session has found out about a motion that it shows.
struct MotionCheck {
  reduced::MotionError error;
  double length = 0;     // of the body [m]
  double tolerance = 0;  // of shape_error: the scene's model.tolerance
  /// Typical largest displacement of the widest training poses, as linear_reach [m].
  double trained_reach = 0;
  double check_ms = 0;  // that it took

  [[nodiscard]] bool within_tolerance() const { return error.shape_error <= tolerance; }
};

/// What is wrong with the motion and what to do; empty where its error is within the tolerance, no
/// tet is inverted and no constraint is missed by more than half a body length.
[[nodiscard]] std::string describe_motion(const MotionCheck& check);

/// Says that a model misses its tolerance, and what to do; empty where it does not.
[[nodiscard]] std::string describe_accuracy(const reduced::ModelReport& report, double tolerance);

/// A motion and what it was to meet.
struct CheckRequest {
  struct Target {
    int frame = 0;
    std::shared_ptr<const std::vector<int>> nodes;  // compact
    unsigned axes = 7;
    Eigen::Vector3d target = {0, 0, 0};  // displacement from rest [m]
  };

  std::shared_ptr<const Result> result;
  std::vector<Target> targets;       // of constraints
  std::vector<int> keyframe_frames;  // of keyframes
};

/// At most so many constrained frames are compared, evenly chosen among them, ..
inline constexpr int kMaxConstrainedFrames = 64;
/// .. and so many others, evenly spread over the motion, its ends included; and the frame in which
/// the shape is farthest from rest.
inline constexpr int kSpreadFrames = 16;

/// Frames to compare, ascending, each once.
/// @param constrained  frames with constraints or keyframes, in any order
/// @param coordinates  q of all frames, h x N
[[nodiscard]] std::vector<int> frames_to_compare(std::vector<int> constrained,
                                                 const Eigen::MatrixXf& coordinates);

/// Compares motions of one session with full reconstructions of the same modal coordinates. What
/// that takes (a factored Laplacian of the mesh, RS coordinates of a base motion) is made by the
/// first check, so that models from a cache cost nothing until then; where that is cancelled, the
/// next one continues with the stages that are left. For one thread at a time.
class MotionChecker {
 public:
  MotionChecker(std::shared_ptr<const scene::Scene> scene,
                std::shared_ptr<const reduced::ReducedModel> model);
  ~MotionChecker();

  /// @throws Error{kCancelled}
  [[nodiscard]] MotionCheck check(const CheckRequest& request, const JobContext& job = {});

 private:
  void prepare(const JobContext& job);

  std::shared_ptr<const scene::Scene> scene_;
  std::shared_ptr<const reduced::ReducedModel> model_;
  std::unique_ptr<const MappedBody> mapped_;   // finished stages of full_, until it is made
  Eigen::MatrixXd base_;                       // as above
  std::unique_ptr<reduced::FullShapes> full_;  // null until all stages are finished
};

}  // namespace limber::session
