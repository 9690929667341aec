#pragma once

#include <cstdint>

#include "engine/beams/model/beam_model.h"

namespace limber::testing {

enum class Bending {
  kDifferent,  // about the two axes of a section
  kAlike,      // as in a tube
};

/// One to three parts that hang together or do not, of stiffnesses up to ten thousand times apart;
/// bars end to end, pressed or pulled along themselves or anywhere, here and there a second
/// support.
[[nodiscard]] beams::BeamModel random_beams(std::uint64_t seed,
                                            Bending bending = Bending::kDifferent);

}  // namespace limber::testing
