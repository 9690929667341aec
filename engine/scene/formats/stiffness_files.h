#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/painted_stiffness.h"

namespace limber::scene {

/// Reads stiffness painted at points, in one of three forms, recognised by the content:
/// - text: a number for each point, separated by blanks, line ends or commas; # begins a comment;
/// - .ply: the property of its vertices that is named stiffness, quality, value or scalar_...;
/// - JSON: {"groups": {"NAME": {"vertices": [ids from 0], "factor": 2}}}, or "youngs_modulus" [Pa]
///   in place of "factor". Points of no group keep their stiffness; no point is in two groups.
/// @param quantity  of the numbers of the first two
/// @param point_count  how many points there are
/// @throws Error{kInvalidArgument} with `name` as field and "name:line: ..." as message
[[nodiscard]] std::vector<PaintedStiffness> read_stiffness(const std::string& name,
                                                           std::string_view content,
                                                           StiffnessQuantity quantity,
                                                           int point_count);

}  // namespace limber::scene
