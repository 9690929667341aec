#pragma once

#include <vector>

#include "engine/scene/linkage.h"

namespace limber::session {

/// Warnings: a linkage more than 1 km large, a section that is likely in another unit than the
/// lines, pairs of segments whose bend is not proven to be minimal, and places where lines touch
/// without a joint. Fields are members of the scene: length_unit_in_metres, section, lines.
/// @pre check_linkage has nothing to say
[[nodiscard]] std::vector<scene::Issue> linkage_remarks(const scene::Linkage& linkage);

}  // namespace limber::session
