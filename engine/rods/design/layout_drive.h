#pragma once

#include "engine/rods/design/straight_layout.h"
#include "engine/rods/section/section.h"

namespace limber::rods {

/// The same layout, drawn for so many times its mean curvature.
[[nodiscard]] StraightLayout driven(StraightLayout layout, double drive);

struct LayoutDrive {
  double drive = 1;
  double height = 0;                                 // that the opened grid comes to [length]
  bool has_opened = false;                           // with any drive
  Eigen::Matrix3Xd joints = Eigen::Matrix3Xd(3, 0);  // of the opened grid
};

/// Finds the drive with which a layout opens to a height, or comes nearest to it, by opening
/// linkages of two dozen drives at most. Rods resist being bent, so that a layout drawn for a
/// surface opens to less than that, or not out of its plane at all. Only the section of the rods
/// matters; their stiffer axis bends them sideways.
/// @param height  root mean square, over the plane nearest to the joints [length], > 0
/// @param least_angle  see is_regular, which layouts stay [rad]
/// @throws Error as section_properties
[[nodiscard]] LayoutDrive drive_to_height(const GridLines& grid, const StraightLayout& layout,
                                          double height, double least_angle,
                                          const Section& section);

}  // namespace limber::rods
