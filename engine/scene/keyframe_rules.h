#pragma once

#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace limber::scene {

/// Every one of them is a row of the solver for each candidate mode.
inline constexpr int kMaxKeyframes = 512;

/// Rules for keyframes of a given scene.
class KeyframeRules {
 public:
  static constexpr double kLeastWeight = 1e-30;

  explicit KeyframeRules(const Scene& scene);

  /// Everything that is wrong with it; fields are relative to it ("frame", "pose").
  [[nodiscard]] std::vector<Issue> faults(const Keyframe& keyframe) const;
  /// The same of parts of it.
  [[nodiscard]] std::optional<Issue> frame_fault(int frame) const;
  [[nodiscard]] static std::optional<Issue> weight_fault(double weight);
  /// The issue for a keyframe in a frame that an end condition holds; empty for others.
  [[nodiscard]] std::optional<Issue> idle_frame(int frame, End first_end, End last_end) const;

 private:
  [[nodiscard]] std::optional<Issue> pose_fault(const Keyframe& keyframe) const;

  int frame_count_, nodes_;
  double reach_;  // bound of |displacement| of a coordinate [scene length unit]
};

/// Everything that is wrong with a scene's keyframes, each with its field ("keyframes[2].frame").
[[nodiscard]] std::vector<Issue> keyframe_issues(const Scene& scene);

}  // namespace limber::scene
