#pragma once

#include "engine/beams/model/beam_model.h"
#include "engine/scene/formats/beam_job.h"

namespace limber::session {

/// A job of the public relaxation code as a structure, in SI units. If any of the directions 3 to 5
/// of a node is fixed (two components of the normal and the spin about it), all its rotations are
/// held. A direction that is fixed and displaced is displaced. The torsion constant is
/// Saint-Venant's. Not validated.
/// @throws Error{kInvalidArgument} naming a dimension or constant of the section that is out of
/// range, as beams::rectangle and beams::make_section
[[nodiscard]] beams::BeamModel model_of(const scene::BeamJobFiles& files);

}  // namespace limber::session
