#pragma once

#include <string>

#include "limber/v1/service.pb.h"

namespace limber::cli::beams {

namespace v1 = limber::v1;

/// " (2 negative eigenvalues)"; nothing at a minimum, and where nothing balances.
[[nodiscard]] std::string inertia_words(unsigned negative_eigenvalues);
/// "at 0.410 of the path: node 3 turns by 0.8 rad"
[[nodiscard]] std::string snap_words(const v1::BeamSnap& snap);
/// "node 6 moves by (0, 0.16, 0) m per radian"
[[nodiscard]] std::string neutral_words(const v1::BeamNeutralDirection& direction);
/// "elements 3, 7"
[[nodiscard]] std::string unjudged_words(
    const google::protobuf::RepeatedField<std::uint32_t>& elements);
/// "0.12 % of the size" and the rest of an estimate, on one line.
[[nodiscard]] std::string discretisation_words(const v1::DiscretisationError& error);

/// Above 1: ", OVERLOADED: ..", else nothing.
[[nodiscard]] std::string overload_words(double utilisation);

}  // namespace limber::cli::beams
