#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace limber::scene {

/// A .vtu file of a motion.
struct VtuFrame {
  std::string name;
  std::string content;
};

/// The .vtu files that a ParaView .pvd lists, in the order of their times; names as it writes them,
/// relative to it.
/// @throws Error{kInvalidArgument} with `name` as field if it is not a .pvd, or lists no file, two
/// files for one time (parts of one body in several files), or one file for two times
[[nodiscard]] std::vector<std::string> pvd_files(const std::string& name, std::string_view content);

/// A motion from one .vtu per frame: the points of each are the positions of the nodes in its
/// frame. Cells are not looked at.
/// @param count       frames
/// @param frame       file of frame i; asked once, in order, so that only one need be in memory
/// @param node_count  points that each must have, or 0: as many as the first
/// @param max_bytes   of the positions of all frames, and of the arrays of one file
/// @returns 3 nodes x frames, 3 * node + axis
/// @throws Error naming frame and file in its message, `name` as field: as readers of meshes do;
/// {kInvalidArgument} for another number of points or a coordinate that is not finite;
/// {kLimitExceeded} beyond `max_bytes`, before the memory is allocated
[[nodiscard]] Eigen::MatrixXd read_vtu_series(const std::string& name, std::size_t count,
                                              const std::function<VtuFrame(std::size_t)>& frame,
                                              Eigen::Index node_count,
                                              std::size_t max_bytes = std::size_t{1} << 31);

}  // namespace limber::scene
