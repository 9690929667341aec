#pragma once

#include <Eigen/Core>
#include <list>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

/// RS coordinates y (9m) of displacements u (3n) with the turns that the tets pass on. Next to a
/// full turn, a rotation's own logarithm has an axis that may point anywhere, which no sum of modes
/// fits.
[[nodiscard]] Eigen::VectorXd smooth_coordinates(const RsInverse& inverse,
                                                 const Eigen::Ref<const Eigen::VectorXd>& u,
                                                 RsTrack& track);

/// The RS coordinates of a motion frame by frame, each frame tracked from the one before. Frames
/// are computed on request from the nearest earlier frame in memory; the result does not depend on
/// the order of requests. Not thread-safe.
class TrackedBase {
 public:
  struct Pose {
    int frame = -1;
    Eigen::VectorXd y;      // 9m
    RsTrack before, after;  // of the frame before, and with this one
  };

  /// @param inverse  kept by reference and must outlive this
  /// @param motion  3n x N displacements from rest [m], finite
  TrackedBase(const RsInverse& inverse, Eigen::MatrixXd motion);

  [[nodiscard]] const Eigen::MatrixXd& motion() const { return motion_; }
  /// @param frame  in [0, N)
  /// @returns valid until the next call
  /// @throws Error{kCancelled}
  [[nodiscard]] const Pose& at(int frame, const JobContext& job = {});

 private:
  const RsInverse& inverse_;
  Eigen::MatrixXd motion_;
  std::vector<RsTrack> checkpoints_;  // entry i: after frame i * kStride; those known so far
  std::list<Pose> recent_;            // newest first
};

}  // namespace limber::reduced
