#include "engine/reduced/tracked_base.h"

#include <algorithm>
#include <utility>

#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {
namespace {

constexpr int kStride = 8;                   // frames from checkpoint to checkpoint
constexpr std::size_t kMaxCachedPoses = 32;  // poses kept: 15 numbers a tet each

}  // namespace

Eigen::VectorXd smooth_coordinates(const RsInverse& inverse,
                                   const Eigen::Ref<const Eigen::VectorXd>& u, RsTrack& track) {
  Eigen::VectorXd y = inverse.coordinates(u, track);
  y.reshaped(kRsSize, y.size() / kRsSize).topRows<3>() = track.counted;
  return y;
}

TrackedBase::TrackedBase(const RsInverse& inverse, Eigen::MatrixXd motion)
    : inverse_(inverse), motion_(std::move(motion)) {}

const TrackedBase::Pose& TrackedBase::at(int frame, const JobContext& job) {
  LIMBER_DEMAND(frame >= 0 && frame < motion_.cols());
  const auto known = std::find_if(recent_.begin(), recent_.end(),
                                  [&](const Pose& pose) { return pose.frame == frame; });
  if (known != recent_.end()) {
    recent_.splice(recent_.begin(), recent_, known);
    return recent_.front();
  }
  const int checkpoint =
      std::min((frame + kStride - 1) / kStride, static_cast<int>(checkpoints_.size())) - 1;
  int next = 0;
  Pose pose;
  if (checkpoint >= 0) {
    pose.after = checkpoints_[static_cast<std::size_t>(checkpoint)];
    next = checkpoint * kStride + 1;
  }
  for (; next <= frame; ++next) {
    job.throw_if_cancelled();
    pose.before = pose.after;
    pose.y = smooth_coordinates(inverse_, motion_.col(next), pose.after);
    if (next == static_cast<int>(checkpoints_.size()) * kStride) checkpoints_.push_back(pose.after);
  }
  pose.frame = frame;
  recent_.push_front(std::move(pose));
  if (recent_.size() > kMaxCachedPoses) recent_.pop_back();
  return recent_.front();
}

}  // namespace limber::reduced
