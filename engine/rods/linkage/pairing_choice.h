#pragma once

#include <vector>

#include "engine/rods/linkage/pairing_sweep.h"

namespace limber::rods::detail {

/// Which of its pairings each joint takes.
struct PairingChoice {
  std::vector<int> pairings;  // of each joint, into JointChoices::pairings
  int bent = 0;               // joints that do not take their straightest one
  bool is_least = true;       // proven: no other choice with letters bends the rods less
  /// A part takes its straightest pairings although these allow no letters, as in weaves of three
  /// families.
  bool is_mixed = false;
};

/// Chooses for the whole mesh. Segments have letters, A or B, where rods are of two families that
/// cross each other: one letter along each rod, the two of a joint different. The straightest
/// pairing of each joint is taken where these allow letters. Elsewhere other candidates are tried,
/// so that the sum of their bends beyond the straightest is least. PairingSweep proves this for
/// parts whose narrowest cut crosses up to about 14 segments, and for wider ones if few joints
/// differ from their straightest pairing. Beyond that, no change within 40 neighbouring joints
/// improves the choice, as far as 4000 tried changes in the mesh show. A part whose candidates
/// allow no letters, or of which none were found, takes its straightest pairings. The result does
/// not depend on the order of joints but for equal bends, where the earlier joint counts.
///
/// @param segments  their number
/// @param joints    in an order that says nothing of how the mesh was numbered
[[nodiscard]] PairingChoice choose_pairings(int segments, const std::vector<JointChoices>& joints);

}  // namespace limber::rods::detail
