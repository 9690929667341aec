#include "engine/reduced/base_frames.h"

#include <fmt/format.h>

#include <utility>

#include "engine/base/error.h"

namespace limber::reduced {

BaseFrames::BaseFrames(Eigen::MatrixXd displacements, int node_count)
    : displacements_(std::move(displacements)) {
  if (!any()) return;
  if (displacements_.rows() != 3 * Eigen::Index{node_count} || !displacements_.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "base_motion",
                fmt::format("base motion has {} rows, expected {}, all finite",
                            displacements_.rows(), 3 * node_count));
  }
}

void BaseFrames::check(std::span<const int> frames) const {
  for (const int frame : frames) check(frame, 1);
}

void BaseFrames::check(int first, Eigen::Index count) const {
  if (!any() || (first >= 0 && first + count <= displacements_.cols())) return;
  throw Error(ErrorCode::kOutOfRange, "frames",
              fmt::format("frame {} is not in the base motion's [0, {})",
                          first < 0 ? first : first + count - 1, displacements_.cols()));
}

Eigen::Vector3d BaseFrames::mean(const std::vector<int>& nodes, int frame) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (!any()) return sum;
  for (const int node : nodes) sum += displacements_.col(frame).segment<3>(3 * node);
  return sum / static_cast<double>(nodes.size());
}

void BaseFrames::add_to(int first, Eigen::MatrixXd& u) const {
  check(first, u.cols());
  if (any()) u += displacements_.middleCols(first, u.cols());
}

}  // namespace limber::reduced
