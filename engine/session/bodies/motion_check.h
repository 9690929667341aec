#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/motion_error.h"
#include "engine/scene/scene.h"

namespace limber::session {

struct MappedBody;
struct BodyResult;

/// Findings of a session about a motion that it shows.
struct MotionCheck {
  struct Shaking {
    double zigzag = 0;  // largest distance of a node from the mean of its neighbour frames [m]
    int frame = 0;
    double high_frequency_share = 0;  // BodyResult::high_frequency_share
  };
  /// How far the motion goes, and the neighbouring frames of exact targets that differ most for the
  /// time between them.
  struct Throw {
    double distance = 0;  // largest, of a node from rest [m]
    int frame = 0;
    int from = 0, to = 0;  // frames of targets; equal: there are none
    double apart = 0;      // of these targets [m]
  };

  reduced::MotionError error;
  double length = 0;     // of the body [m]
  double tolerance = 0;  // of shape_error: the scene's model.tolerance
  /// Largest distance of a target from where the shown motion has its nodes: the
  /// max_constraint_error of the result's report [m].
  double shown_constraint_error = 0;
  double shown_exact_error = 0;                // the same of exact constraints alone [m]
  double shown_velocity_error = 0;             // the max_velocity_error of that report [m/frame]
  double frames_per_second = 1;                // numbers of messages are per second
  std::optional<double> constraint_tolerance;  // the scene's [m]
  double length_unit = 1;                      // of the scene [m]: numbers of messages are in it
  /// For a fitted motion: largest distance of a node from one frame to the next [m], in the shown
  /// motion and in the motion with forces alone that the fit began with. Both are 0 without a fit.
  double largest_step = 0, largest_step_of_start = 0;
  /// Typical largest displacement of the widest training poses, as linear_reach [m].
  double trained_reach = 0;
  /// Largest distance of a position target from rest [m], and its frame.
  double farthest_target = 0;
  int farthest_target_frame = 0;
  std::uint64_t farthest_target_id = 0;
  Shaking shaking;
  Throw thrown;
  /// The result says itself which constraints are out of reach.
  bool is_reach_reported = false;
  /// Exact constraints depend on or contradict each other, and are missed.
  bool is_contradictory = false;
  bool is_exact = false;  // the result's: energies and misses are those of the full map
  double check_ms = 0;    // that it took

  [[nodiscard]] bool within_tolerance() const { return error.shape_error <= tolerance; }
};

/// As a share of the body's length: smaller misses are not visible.
inline constexpr double kMinVisibleMiss = 1e-3;
/// A velocity error is visible if it makes that distance in so many frames. The number is the
/// largest velocity of a just visible swing of the default period, 40 frames.
inline constexpr double kVisibleFrames = 6.4;
/// Limits of a motion that is neither abrupt nor shaking: largest zigzag [body lengths] and
/// high_frequency_share.
inline constexpr double kMaxZigzag = 0.02, kMaxHighFrequencyShare = 1e-4;

/// The problem of the motion and its remedy. Empty where
/// - its error and that of its worst frame are within the tolerance,
/// - no tet is inverted in the compared frames,
/// - the full shapes miss no constraint by more than half a body length, constraint_tolerance, or
///   1.5 times the miss of the shown ones (and kMinVisibleMiss more). The limit for exact
///   constraints is kMinVisibleMiss; for velocities the same holds, without constraint_tolerance,
/// - a fitted motion makes no larger step from frame to frame than the one it began with,
/// - it does not shake (kMaxZigzag, kMaxHighFrequencyShare), and exact targets do not throw the
///   body.
[[nodiscard]] std::string describe_motion(const MotionCheck& check);

/// Says that a model misses its tolerance, and what to do; empty where it does not.
[[nodiscard]] std::string describe_accuracy(const reduced::ModelReport& report, double tolerance);

/// A motion and its targets.
struct CheckRequest {
  struct Target {
    int frame = 0;
    std::optional<int> since;  // of a velocity: the frame from which it is measured
    std::shared_ptr<const reduced::Site> site;
    unsigned axes = 7;
    Eigen::Vector3d target = {0, 0, 0};  // displacement from rest [m], or velocity [m/frame]
    bool is_exact = false;
    std::uint64_t id = 0;  // of the constraint
  };

  std::shared_ptr<const BodyResult> result;
  std::shared_ptr<const reduced::ReducedModel> model;  // whose coordinates the result has
  std::shared_ptr<const scene::Scene> scene;           // of the checker
  std::vector<Target> targets;                         // of constraints
  std::vector<int> keyframe_frames;                    // of keyframes
  std::shared_ptr<const reduced::AddedPoses> added;    // of keyframes; null: none
  /// q of the motion with forces alone that the fit of the result's material began with; null where
  /// none was fitted.
  std::shared_ptr<const Eigen::MatrixXf> start_of_fit;
  bool is_cyclic = false;
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

/// Compares motions of one session with full reconstructions of the same modal coordinates. The
/// first check makes the data for that (a factored Laplacian of the mesh, RS coordinates of a base
/// motion), so that models from a cache cost nothing until then. If that check is cancelled, the
/// next one continues with the remaining stages. For one thread at a time.
class MotionChecker {
 public:
  MotionChecker(std::shared_ptr<const scene::Scene> scene,
                std::shared_ptr<const reduced::ReducedModel> model);
  ~MotionChecker();

  [[nodiscard]] const std::shared_ptr<const reduced::ReducedModel>& model() const { return model_; }
  [[nodiscard]] const std::shared_ptr<const scene::Scene>& scene() const { return scene_; }

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
