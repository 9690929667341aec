#pragma once

#include <vector>

#include "engine/beams/model/beam_model.h"
#include "engine/scene/scene.h"

namespace limber::session {

/// Warnings: nodes that no element uses, which are left out; elements without normals that continue
/// each other with sections rotated against each other; gravity that has no effect. Fields are
/// members of the model.
[[nodiscard]] std::vector<scene::Issue> beam_remarks(const beams::BeamModel& model);

}  // namespace limber::session
