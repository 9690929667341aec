#include "engine/reduced/full_shapes.h"

#include <algorithm>
#include <map>
#include <utility>

#include "engine/base/parallel.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

/// RS coordinates of a base motion, as base_motion() has them: each frame follows the one before.
class FullShapes::Base {
 public:
  Base(const bodies::ElasticBody& body, const bodies::GradientOperator& gradient,
       Eigen::MatrixXd motion)
      : inverse_(body, gradient),
        motion_(std::move(motion)),
        stride_(std::max(1, static_cast<int>(motion_.cols() / kCheckpoints))),
        most_(std::clamp<std::size_t>(
            kCoordinateBytes / (sizeof(float) * kRsSize *
                                static_cast<std::size_t>(std::max(1, gradient.tet_count()))),
            1, kMaxKeptFrames)) {}

  [[nodiscard]] const Eigen::MatrixXd& motion() const { return motion_; }

  /// y of a frame, 9m, in single precision: far finer than what any model is worth.
  /// @returns valid until the next call
  [[nodiscard]] const Eigen::VectorXf& at(int frame, const JobContext& job) {
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

 private:
  static constexpr int kCheckpoints = 16;             // frames whose track is kept, about
  static constexpr std::size_t kMaxKeptFrames = 128;  // frames whose coordinates are kept at most
  static constexpr std::size_t kCoordinateBytes = std::size_t{256}
                                                  << 20;  // of kept coordinates at most

  RsInverse inverse_;
  Eigen::MatrixXd motion_;
  int stride_;
  std::size_t most_;
  std::map<int, RsTrack> checkpoints_;          // after these frames
  std::map<int, Eigen::VectorXf> coordinates_;  // of these frames
  int newest_frame_ = -1;                       // that newest_ is of
  RsTrack newest_;
};

FullShapes::FullShapes(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
                       Eigen::MatrixXd base)
    : model_(std::move(model)), full_(body) {
  LIMBER_DEMAND(model_ != nullptr && model_->node_count == body.mesh.node_count());
  if (base.size() == 0) return;
  LIMBER_DEMAND(base.rows() == 3 * Eigen::Index{body.mesh.node_count()});
  base_ = std::make_unique<Base>(body, full_.gradient(), std::move(base));
}
FullShapes::~FullShapes() = default;
FullShapes::FullShapes(FullShapes&&) noexcept = default;
FullShapes& FullShapes::operator=(FullShapes&&) noexcept = default;

Eigen::MatrixXd FullShapes::displacements(std::span<const int> frames,
                                          const Eigen::Ref<const Eigen::MatrixXd>& linear,
                                          const JobContext& job) {
  LIMBER_DEMAND(linear.cols() == static_cast<Eigen::Index>(frames.size()));
  if (!base_) return full_.from_linear(linear, job);
  const Eigen::VectorXd& share = full_.mass_share();
  Eigen::MatrixXd u(linear.rows(), linear.cols());
  constexpr Eigen::Index kAtOnce = 4;  // bounds memory, and how long a cancellation is not heard
  for (Eigen::Index first = 0; first < linear.cols(); first += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, linear.cols() - first);
    Eigen::MatrixXd y = linear_coordinates(full_.gradient(), linear.middleCols(first, count));
    for (Eigen::Index i = 0; i < count; ++i)
      y.col(i) += base_->at(frames[static_cast<std::size_t>(first + i)], job).cast<double>();
    job.throw_if_cancelled();
    u.middleCols(first, count) = full_.from_coordinates(y);
    if (share.size() == 0) continue;
    // The centre of mass goes where base motion and linear displacement take it together.
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::VectorXd rigid =
          linear.col(first + i) + base_->motion().col(frames[static_cast<std::size_t>(first + i)]);
      const Eigen::Vector3d shift =
          Eigen::Map<const Eigen::Matrix3Xd>(rigid.data(), 3, share.size()) * share;
      Eigen::Map<Eigen::Matrix3Xd>(u.col(first + i).data(), 3, share.size()).colwise() += shift;
    }
  }
  return u;
}

}  // namespace limber::reduced
