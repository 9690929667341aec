#pragma once

#include "engine/beams/model/beam_model.h"
#include "engine/scene/formats/beam_job.h"

namespace limber::session {

/// A job of the public relaxation code as a structure, in SI units. Of a node that any of the
/// directions 3 to 5 (two components of the normal and the spin about it) is fixed of, all
/// rotations are held; one that is fixed and displaced is displaced; the torsion constant is that
/// of Saint-Venant. Not validated.
/// @throws Error{kInvalidArgument} naming a dimension or constant of the section that is out of
/// range, as beams::rectangle and beams::make_section
[[nodiscard]] beams::BeamModel model_of(const scene::BeamJobFiles& files);

}  // namespace limber::session
