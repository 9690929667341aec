#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace limber::scene {

/// A .pc2 point cache as Blender's Mesh Cache modifier and 3ds Max read it: positions of all
/// vertices per sample.
struct PointCache {
  float start_frame = 0;
  float frames_per_sample = 1;
  Eigen::MatrixXf positions;  // 3 points x samples, 3 * point + axis

  [[nodiscard]] int point_count() const { return static_cast<int>(positions.rows() / 3); }
  [[nodiscard]] int sample_count() const { return static_cast<int>(positions.cols()); }
};

/// @throws Error{kInvalidArgument} with the name as field for bytes that are no point cache, are
/// cut off, have more
///   than the header says, or hold a value that is not finite; {kUnsupported} for a version other
///   than 1.
[[nodiscard]] PointCache read_pc2(const std::string& name, std::string_view content);
/// @throws Error{kInvalidArgument} if the positions are not a whole number of points.
[[nodiscard]] std::string write_pc2(const PointCache& cache);

}  // namespace limber::scene
