#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>

#include "engine/base/job.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

/// RS coordinates of the frames of a base motion over all tets, as base_motion() has them for the
/// cubature tets: each frame follows the one before. Frames are worked out when they are first
/// requested, from the nearest frame before whose branches are known; the result does not depend on
/// the order of requests. Some frames are kept. Not thread-safe.
class BaseCoordinates {
 public:
  /// @param gradient  of body.mesh; kept by reference
  /// @param motion  displacements from rest, 3n x N [m], finite
  BaseCoordinates(const bodies::ElasticBody& body, const bodies::GradientOperator& gradient,
                  Eigen::MatrixXd motion);

  [[nodiscard]] const Eigen::MatrixXd& motion() const { return motion_; }

  /// y of a frame, 9m, in single precision: far finer than the error of any model.
  /// @param frame  in [0, N)
  /// @returns valid until the next call
  /// @throws Error{kCancelled}
  [[nodiscard]] const Eigen::VectorXf& at(int frame, const JobContext& job = {});

 private:
  static constexpr int kCheckpoints = 16;  // over the motion
  static constexpr std::size_t kMaxKeptFrames = 128;
  static constexpr std::size_t kCoordinateBytes = std::size_t{256} << 20;  // of kept frames

  RsInverse inverse_;
  Eigen::MatrixXd motion_;
  int stride_;                                  // frames from checkpoint to checkpoint
  std::size_t most_;                            // frames kept
  std::map<int, RsTrack> checkpoints_;          // after these frames
  std::map<int, Eigen::VectorXf> coordinates_;  // of these frames
  int newest_frame_ = -1;                       // that newest_ is of
  RsTrack newest_;
};

}  // namespace limber::reduced
