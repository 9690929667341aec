#include "engine/reduced/base_coordinates.h"

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {

BaseCoordinates::BaseCoordinates(const bodies::ElasticBody& body,
                                 const bodies::GradientOperator& gradient, Eigen::MatrixXd motion)
    : inverse_(body, gradient),
      motion_(std::move(motion)),
      stride_(std::max(1, static_cast<int>(motion_.cols() / kCheckpoints))),
      most_(std::clamp<std::size_t>(
          kCoordinateBytes / (sizeof(float) * kRsSize *
                              static_cast<std::size_t>(std::max(1, gradient.tet_count()))),
          1, kMaxKeptFrames)) {
  LIMBER_DEMAND(motion_.rows() == 3 * Eigen::Index{body.mesh.node_count()});
}

const Eigen::VectorXf& BaseCoordinates::at(int frame, const JobContext& job) {
  LIMBER_DEMAND(frame >= 0 && frame < motion_.cols());
  if (const auto found = coordinates_.find(frame); found != coordinates_.end())
    return found->second;
  int next = 0;
  RsTrack track;
  if (newest_frame_ >= 0 && newest_frame_ < frame) {
    next = newest_frame_ + 1;
    track = newest_;
  }
  // The nearest frame before this one whose track is known.
  if (const auto after = checkpoints_.upper_bound(frame - 1); after != checkpoints_.begin()) {
    const auto& [at, checkpoint] = *std::prev(after);
    if (at + 1 > next) {
      next = at + 1;
      track = checkpoint;
    }
  }
  Eigen::VectorXd y;
  for (; next <= frame; ++next) {
    job.throw_if_cancelled();
    y = inverse_.coordinates(motion_.col(next), track);
    if (next % stride_ == 0) checkpoints_.try_emplace(next, track);
  }
  newest_frame_ = frame;
  newest_ = std::move(track);
  if (coordinates_.size() >= most_) {  // those of far frames go first
    const bool first_is_farther =
        frame - coordinates_.begin()->first > coordinates_.rbegin()->first - frame;
    coordinates_.erase(first_is_farther ? coordinates_.begin() : std::prev(coordinates_.end()));
  }
  return coordinates_[frame] = y.cast<float>();
}

}  // namespace limber::reduced
