#pragma once

#include <string>

#include "limber/v1/service.pb.h"

namespace limber::cli::beams {

namespace v1 = limber::v1;

/// " (2 negative eigenvalues)"; nothing at a minimum, and where nothing balances.
[[nodiscard]] std::string inertia_words(unsigned negative_eigenvalues);
/// "at 0.410 of the way: node 3 turns by 0.8 rad"
[[nodiscard]] std::string snap_words(const v1::BeamSnap& snap);

}  // namespace limber::cli::beams
