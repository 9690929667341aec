#pragma once

#include <vector>

#include "engine/rods/linkage/pairing_sweep.h"

namespace limber::rods::detail {

/// Which of its pairings each joint takes, so that rods are of two families that cross each other.
struct PairingChoice {
  std::vector<int> pairings;  // of each joint, into JointChoices::pairings
  int bent = 0;               // joints that do not take their straightest one
  bool is_least = true;       // proven: no other choice bends the rods less
};

/// Chooses for the whole mesh. The straightest pairing of each joint is taken where these fit
/// together. Elsewhere the sum of the bends beyond that is least: exactly, as PairingSweep proves
/// (parts whose narrowest cut crosses up to about 14 segments always; wider ones where few joints
/// differ from their straightest pairing); beyond that it is a choice which no change within 40
/// neighbouring joints improves, as far as 4000 such changes tried in the mesh say. The result does
/// not depend on the order of joints but for equal bends, where the earlier joint counts.
///
/// Segments need letters, A or B: at each joint two of each (four segments), two and one (three),
/// one and one (two). Such letters alternate along a closed walk over all segments of a part
/// (which free ends and joints of three segments let begin anywhere). So they exist, for any
/// straightest pairings, but where no part has free ends or joints of three segments and its
/// segments are odd in number.
///
/// @param segments  their number
/// @param joints    in an order that says nothing of how the mesh was numbered
/// @param vertices  of the joints, for messages
/// @throws Error{kInvalidArgument} naming a vertex and the smallest contradicting loop where no
/// choice exists
[[nodiscard]] PairingChoice choose_pairings(int segments, const std::vector<JointChoices>& joints,
                                            const std::vector<int>& vertices);

}  // namespace limber::rods::detail
