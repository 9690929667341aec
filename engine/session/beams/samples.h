#pragma once

#include <string>
#include <vector>

#include "engine/beams/model/beam_model.h"

namespace limber::session {

/// A structure made by limber itself, of tubes of one material. SI units.
struct BeamSample {
  beams::BeamModel model;
  double outer_radius = 0, inner_radius = 0;
  beams::BeamMaterial material;
};

/// "arch": a rod that bends upwards when its right end moves inwards; "gridshell": a flat grid of
/// rods that rises when its rim moves inwards.
[[nodiscard]] const std::vector<std::string>& beam_sample_names();
/// @throws Error{kNotFound}
[[nodiscard]] BeamSample make_beam_sample(const std::string& name);

}  // namespace limber::session
