#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/full_shapes.h"
#include "engine/reduced/site.h"

namespace limber::reduced {

/// A site whose displacement is to be right in the frame of a column.
struct HeldSite {
  int column = 0;
  std::shared_ptr<const Site> site;
};

struct FrameProjectionOptions {
  double tolerance = 1e-3;  // of the shape error over the frames, in (0, 1)
  int max_columns = 24;     // added to the basis at most, >= 0

  void validate() const;
};

/// Full shapes of frames of a motion, through a basis that was extended where it missed them.
struct ProjectedFrames {
  Eigen::MatrixXd columns;      // 3n x c, orthonormal and orthogonal to the basis; c may be 0
  Eigen::MatrixXd coordinates;  // (h + c) x k: the shape is [B, columns] times these
  /// Root mean square distance between shapes and full shapes over the displacement, as
  /// MotionError::shape_error: through the basis alone, and with its new columns.
  double error_before = 0, error_after = 0;
};

/// Reconstructs the frames in full and projects them on the basis. Columns are principal components
/// of the projection errors of the frames with the largest error. They are added until the error is
/// below the tolerance or there are max_columns. The error at held sites is removed by the smallest
/// change of the frame's coordinates, so that the shown frames meet the constraints. Deterministic,
/// whatever the number of threads.
/// @param basis  B, 3n x h, orthonormal
/// @param frames  ascending; @param modal  z-hat, R x k
/// @throws Error{kCancelled}
[[nodiscard]] ProjectedFrames project_frames(FullShapes& shapes, const Eigen::MatrixXd& basis,
                                             std::span<const int> frames,
                                             const Eigen::Ref<const Eigen::MatrixXd>& modal,
                                             const std::vector<HeldSite>& held,
                                             const FrameProjectionOptions& options,
                                             const JobContext& job = {});

/// The same of given shapes. @param displacements  3n x k
[[nodiscard]] ProjectedFrames project_displacements(Eigen::MatrixXd displacements,
                                                    const Eigen::MatrixXd& basis,
                                                    const std::vector<HeldSite>& held,
                                                    const FrameProjectionOptions& options,
                                                    const JobContext& job = {});

}  // namespace limber::reduced
