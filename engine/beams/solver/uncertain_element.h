#pragma once

#include <optional>
#include <string>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

/// An element that balances where the model of elements says nothing of stability any more.
struct UncertainElement {
  int element = -1;
  /// Far enough that the balance is none of the beam; else a finer structure may well have one
  /// near.
  bool hopeless = false;
  std::string message;  // a sentence for people
};

/// The worst of the doubtful elements. An element is doubtful if it is pressed beyond its own
/// buckling load whatever its ends do (4 pi^2 EI / L^2). It is doubtful too if its ends have turned
/// a quarter round against its chord, or are twisted against each other by more than 1.25 rad.
/// Nodes cannot show how such an element buckles, bends or twists: that is no equilibrium of the
/// beam.
[[nodiscard]] std::optional<UncertainElement> find_uncertain_element(const BeamStructure& structure,
                                                                     const BeamState& state);

}  // namespace limber::beams::detail
