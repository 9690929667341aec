#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/full_shapes.h"
#include "engine/reduced/site.h"

namespace limber::reduced {

/// "In the frame of this column, the displacement of this site is that", or its mean velocity from
/// the frame of one column to that of another.
struct ShapeTarget {
  int column = 0;
  std::shared_ptr<const Site> site;
  unsigned axes = 7;                        // bit 0: x, bit 1: y, bit 2: z
  Eigen::Vector3d target = {0, 0, 0};       // displacement from rest [m], or [m/frame]
  bool is_exact = false;                    // of a constraint that is to hold exactly
  std::optional<int> since = std::nullopt;  // of a velocity: the column where it begins
};

/// Some shown frames of a motion, and the targets of these frames.
struct ShownFrames {
  std::vector<int> frames;      // k, ascending
  Eigen::MatrixXd modal;        // z of W-hat, R x k
  Eigen::MatrixXf coordinates;  // q, h x k: the shown displacement is B q
  /// B, 3n x h; null: the model's.
  std::shared_ptr<const Eigen::MatrixXd> basis;
  std::vector<ShapeTarget> targets;
};

/// The error of a model for one motion: shown shapes against full reconstructions of the same z.
struct MotionError {
  /// Root mean square distance of nodes between both, over all compared frames, as a share of the
  /// root mean square displacement of the full shapes. Displacements of a free body are taken
  /// without their mean, so that a translation does not dilute its error.
  double shape_error = 0;
  /// The same of the worst single frame. One that moves less than a tenth of the mean counts as if
  /// it moved as much as that.
  double worst_frame_error = 0;
  int worst_frame = 0;
  double max_distance = 0;  // of a node between both [m]
  /// Largest distance of a target from where the full reconstruction has its nodes, over its axes
  /// [m].
  double max_constraint_error = 0;
  double max_exact_error = 0;  // the same of exact targets only [m]
  /// The same of velocities [m/frame].
  double max_velocity_error = 0, max_exact_velocity_error = 0;
  int inverted_tets = 0;  // of the shown frame that has most of them
  int inverted_frame = 0;
  int frames = 0;  // that were compared
  /// Largest displacement of a node in the linear pose W-hat z, rigid motions left out, and its
  /// frame [m]: what training poses are measured by.
  double linear_reach = 0;
  int reach_frame = 0;
};

/// @returns the same for any number of threads
/// @throws Error{kCancelled}, within a pass over the tets
[[nodiscard]] MotionError motion_error(FullShapes& full, const ShownFrames& shown,
                                       const JobContext& job = {});

}  // namespace limber::reduced
