#pragma once

#include <vector>

#include "engine/scene/linkage.h"

namespace limber::session {

/// Warnings: places where lines of a linkage touch and are not joined. Fields are members of the
/// scene: lines.
/// @pre check_linkage has nothing to say
[[nodiscard]] std::vector<scene::Issue> linkage_remarks(const scene::Linkage& linkage);

}  // namespace limber::session
