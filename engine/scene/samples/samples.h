#pragma once

#include <string>
#include <vector>

#include "engine/scene/scene.h"

namespace limber::scene {

/// Names of the scenes that limber can make by itself.
[[nodiscard]] const std::vector<std::string>& sample_names();

/// A complete scene [m]: mesh, material, fixed nodes, frames, dynamics, model request and a few
/// constraints that a body of its kind can follow. The same bits on every call.
///
/// - beam: a bar of 16 x 8 x 8 cells of 6 tets (6144 tets), one end fixed
/// - flower: a slender stem, foot fixed, with a head of curved petals; a circle for its top (the
///   paper's figure 5)
/// - bird: a body with wings, tail and beak, held at its middle
/// - dino: body, neck, head, tail and four legs, feet fixed
/// @throws Error{kNotFound} listing the names there are
[[nodiscard]] Scene make_sample(const std::string& name);

}  // namespace limber::scene
