#pragma once

#include <Eigen/Core>
#include <string>

#include "limber/v1/scene.pb.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/paths.h"

namespace limber::server {

/// Positions of a base motion that comes as files, 3 nodes x frames: .pc2, .pvd with its .vtu, or
/// .vtu in order; as bytes or as paths.
/// @param nodes  of the mesh; 0: unknown
/// @throws Error or Refusal naming `field` + ".pc2", ".path", ".vtu_series...."; of a series the
/// message names frame and file
[[nodiscard]] Eigen::MatrixXd read_base_motion(const proto::BaseMotion& motion,
                                               const std::string& field, int nodes,
                                               const FileReader& read_file);

/// The same, of files of this machine.
/// @param resolve  the file that a path means, or throws naming the field
[[nodiscard]] MotionReader base_motion_reader(PathResolver resolve);

/// Whether it is a .pc2, as bytes or as a path. It is then of single precision and, for a body far
/// from the origin, relative to its middle, as exports write it.
[[nodiscard]] bool is_point_cache(const proto::BaseMotion& motion);

}  // namespace limber::server
