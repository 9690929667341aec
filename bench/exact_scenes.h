#pragma once

#include "engine/scene/scene.h"

namespace limber::bench {

/// The sample beam, 200 frames, with targets in frame 100 alone. @param degrees  angle of its end.
/// Along an arc, in its plane of least stiffness.
[[nodiscard]] scene::Scene bent_beam(double degrees);
/// At the corners of its end.
[[nodiscard]] scene::Scene twisted_beam(double degrees);

}  // namespace limber::bench
