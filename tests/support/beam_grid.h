#pragma once

#include "engine/beams/model/beam_model.h"

namespace limber::testing {

/// A flat square grid of glass-fibre rods that cross rigidly, under its own weight.
struct BeamGrid {
  int nodes = 71;        // along a side
  double side = 20;      // [m]
  double radius = 0.01;  // of the rods [m]
  enum class Held {
    kRim,         // all nodes of the rim, translations
    kRimClamped,  // the same, and rotations
    kCorners,     // four nodes, translations
  } held = Held::kRim;
};
[[nodiscard]] beams::BeamModel beam_grid(const BeamGrid& grid);

}  // namespace limber::testing
