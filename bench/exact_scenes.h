#pragma once

#include "bench/suite.h"
#include "engine/scene/scene.h"
#include "tests/support/material_bodies.h"

namespace limber::bench {

/// The sample beam, 200 frames, with targets in frame 100 alone. @param degrees  angle of its end.
/// Along an arc, in its plane of least stiffness.
[[nodiscard]] scene::Scene bent_beam(double degrees);
/// At the corners of its end.
[[nodiscard]] scene::Scene twisted_beam(double degrees);

/// The beams and the public bodies that are selected, in their order.
/// @param suite  has run(name, scene) and run_public(BodyFile)
template <class Suite>
void run_exact_scenes(Suite suite) {
  if (is_selected("beam, bent by 270 degrees"))
    suite.run("beam, bent by 270 degrees", bent_beam(270));
  if (is_selected("beam, twisted by 135 degrees"))
    suite.run("beam, twisted by 135 degrees", twisted_beam(135));
  for (const testing::BodyFile& file : testing::public_bodies())
    if (is_selected(file.name)) suite.run_public(file);
}

}  // namespace limber::bench
