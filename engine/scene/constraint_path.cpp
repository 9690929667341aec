#include "engine/scene/constraint_path.h"

#include <fmt/format.h>

#include "engine/base/error.h"

namespace limber::scene {
namespace {

/// The key with this number, the constraint itself being the first.
PathKey key(const Constraint& constraint, std::size_t number) {
  return number == 0 ? PathKey{constraint.frame, constraint.target} : constraint.path[number - 1];
}

/// Speed of the piece that begins with this key, per frame.
Eigen::Vector3d speed(const Constraint& constraint, std::size_t piece) {
  const PathKey from = key(constraint, piece), to = key(constraint, piece + 1);
  return (to.target - from.target) / (to.frame - from.frame);
}

/// At an inner key the weighted harmonic mean of both speeds, 0 where they differ in sign.
Eigen::Vector3d slope(const Constraint& constraint, std::size_t number) {
  if (number == 0) return (1 - constraint.ease_in) * speed(constraint, 0);
  if (number == constraint.path.size())
    return (1 - constraint.ease_out) * speed(constraint, number - 1);
  const Eigen::Vector3d before = speed(constraint, number - 1), after = speed(constraint, number);
  const double left = key(constraint, number).frame - key(constraint, number - 1).frame;
  const double right = key(constraint, number + 1).frame - key(constraint, number).frame;
  const double share = (1 + right / (left + right)) / 3;
  Eigen::Vector3d result = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (!(before[axis] * after[axis] > 0)) continue;
    result[axis] = before[axis] * after[axis] / (share * after[axis] + (1 - share) * before[axis]);
  }
  return result;
}

void check_ease(double ease, const char* field) {
  if (ease >= 0 && ease <= 1) return;
  throw Error(ErrorCode::kOutOfRange, field, fmt::format("must be in [0, 1], is {:g}", ease));
}

}  // namespace

Eigen::Vector3d target_in(const Constraint& constraint, int frame) {
  if (constraint.path.empty()) return constraint.target;
  std::size_t piece = 0;
  while (piece + 1 < constraint.path.size() && frame >= constraint.path[piece].frame) ++piece;
  const PathKey from = key(constraint, piece), to = key(constraint, piece + 1);
  const double length = to.frame - from.frame, s = (frame - from.frame) / length;
  const double rest = 1 - s;
  return from.target + (s * s * (1 + 2 * rest)) * (to.target - from.target) +
         length * (s * rest * rest * slope(constraint, piece) -
                   s * s * rest * slope(constraint, piece + 1));
}

void move_path(Constraint& constraint, const Eigen::Vector3d& target) {
  const Eigen::Vector3d by = target - constraint.target;
  constraint.target = target;
  for (PathKey& further : constraint.path) further.target += by;
}

void check_path(const Constraint& constraint, int frame_count) {
  check_ease(constraint.ease_in, "ease_in");
  check_ease(constraint.ease_out, "ease_out");
  if (constraint.reach && !(*constraint.reach > 0 && *constraint.reach <= kGreatestReach)) {
    throw Error(ErrorCode::kOutOfRange, "reach",
                fmt::format("must be in (0, {:g}] s, is {:g}", kGreatestReach, *constraint.reach));
  }
  if (constraint.path.empty()) return;
  if (constraint.kind == TargetKind::kVelocity) {
    throw Error(ErrorCode::kInvalidArgument, "path",
                "a path is one of positions or displacements, not of velocities");
  }
  int before = constraint.frame;
  for (std::size_t i = 0; i < constraint.path.size(); ++i) {
    const auto& [frame, target] = constraint.path[i];
    const std::string field = fmt::format("path[{}].", i);
    if (frame < 0 || frame >= frame_count) {
      throw Error(ErrorCode::kOutOfRange, field + "frame",
                  fmt::format("frame {} is outside 0 .. {}", frame, frame_count - 1));
    }
    if (frame <= before) {
      throw Error(
          ErrorCode::kInvalidArgument, field + "frame",
          fmt::format("frame {} must be later than that of the key before, {}", frame, before));
    }
    if (!target.allFinite())
      throw Error(ErrorCode::kInvalidArgument, field + "target", "is not finite");
    before = frame;
  }
  if (before - constraint.frame >= kMaxPathFrames) {
    throw Error(ErrorCode::kLimitExceeded, "path",
                fmt::format("has {} frames; one path may have {}", before - constraint.frame + 1,
                            kMaxPathFrames));
  }
}

}  // namespace limber::scene
