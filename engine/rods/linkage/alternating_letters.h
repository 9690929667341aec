#pragma once

#include "engine/rods/linkage/pairing_sweep.h"

namespace limber::rods::detail {

/// Gives the segments of one part letters that alternate along a closed walk over all of them, so
/// that each joint has as many of one letter as of the other, or one more.
/// @param members  joints of the part; where all have two or four segments and none of these has a
/// free end, the number of segments must be even
/// @param letters  of all segments; set for those of the part
void alternate_letters(const std::vector<JointChoices>& joints, const std::vector<int>& members,
                       SegmentLetters& letters);

}  // namespace limber::rods::detail
