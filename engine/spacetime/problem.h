#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "engine/reduced/kinematics.h"

namespace limber::spacetime {

/// The condition on the motion at one end of the time line.
enum class EndCondition {
  kFree,                    // no condition: a free damped oscillation has no cost
  kPinnedPosition,          // z = 0 in the end frame
  kPinnedPositionVelocity,  // z = 0 in the end frame and the one beside it
  kCyclic,  // of both ends or of none: frame 0 follows the last one, N frames after itself
};

/// How a free mode goes from frame to frame (ForceStencil).
enum class Discretisation {
  kDifferences,  // the paper's differences, with the frame as their step
  kSampled,      // free motion is exact at the frames, at any frequency
};

/// Linear modal dynamics with the frame as the unit of time (paper: space-time editing, eqs. 3 and
/// 17a): z'' + d z' + lambda z = 0 without forces. A mode of frequency omega and damping ratio zeta
/// has lambda = omega^2 and d = 2 zeta omega. The minimised E_f is the sum over the modes of c w/2
/// sum_i (f_i^2 + tau^2 (f_(i+1) - f_i)^2), f_i the forces on a mode (ForceRows).
struct ModeDynamics {
  Eigen::VectorXd stiffness;  // lambda, r, [1/frame^2], >= 0
  Eigen::VectorXd damping;    // d, r, [1/frame], >= 0
  Discretisation discretisation = Discretisation::kDifferences;
  double smoothing = 0;  // tau [frames], >= 0: about the time in which forces change
  double scale = 1;      // c > 0: E_f in other units of time than the frame
  /// w, r, > 0: the relative cost of the forces on each mode; empty: 1.
  Eigen::VectorXd shares = {};

  [[nodiscard]] double force_weight(Eigen::Index mode) const {
    return shares.size() > 0 ? scale * shares[mode] : scale;
  }
};

struct Timeline {
  int frame_count = 0;  // N >= 3, and enough for the end conditions to leave a free frame
  EndCondition first = EndCondition::kPinnedPositionVelocity;
  EndCondition last = EndCondition::kPinnedPositionVelocity;

  [[nodiscard]] bool is_cyclic() const { return first == EndCondition::kCyclic; }
};

/// Frames first .. first + count - 1.
struct FrameSpan {
  int first = 0;
  int count = 0;
};

using ConstraintId = std::uint64_t;

/// A target for the displacement of a site at a frame, or for its mean velocity from one frame to
/// another. It is compared with u(frame) or, with `since`, (u(frame) - u(since)) / (frame - since).
/// Only the axes of the mask count.
struct PositionConstraint {
  static constexpr double kExact =
      std::numeric_limits<double>::infinity();  // weight of constraints that are held exactly

  ConstraintId id = 0;
  int frame = 0;  // in [0, N)
  reduced::SiteId site = 0;
  unsigned axes = 7;                   // bit 0: x, bit 1: y, bit 2: z; at least one
  Eigen::Vector3d target = {0, 0, 0};  // displacement from rest [m]
  double weight = 100;  // gamma > 0, on (|u - target| / body length)^2 / 2; kExact: hold exactly
  /// For a constraint on a mean velocity: the frame where it begins, in [0, frame). In a cycle it
  /// is any other frame; a later one means over the seam. The target is in [m/frame], gamma on
  /// (|velocity - target| / body length * 1 frame)^2 / 2.
  std::optional<int> since = std::nullopt;
  /// [frames], >= 0. Farther from those that it reads, the motion is that without all constraints
  /// that have a reach. Nothing: it acts everywhere.
  std::optional<int> reach = std::nullopt;

  [[nodiscard]] bool is_velocity() const { return since.has_value(); }
  bool operator==(const PositionConstraint&) const = default;
};

/// "At this frame, the body has this pose" (E_c^RS, paper: eq. 23): S z = z-bar, all of it.
struct KeyframeConstraint {
  ConstraintId id = 0;          // own numbering: keyframes and positions may have equal ids
  int frame = 0;                // in [0, N)
  Eigen::VectorXd coordinates;  // z-bar, R modal coordinates (reduced::ModalProjector)
  double weight = 100;          // gamma > 0, on |S z - z-bar|^2 / 2; kExact as for positions

  bool operator==(const KeyframeConstraint&) const = default;
};

/// All that a motion is asked to meet.
struct ConstraintSet {
  std::map<ConstraintId, PositionConstraint> positions;
  std::map<ConstraintId, KeyframeConstraint> keyframes;
};

}  // namespace limber::spacetime
