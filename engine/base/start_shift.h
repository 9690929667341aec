#pragma once

#include <Eigen/Core>
#include <string_view>

namespace limber {

/// Share by which solvers move the values that they start from: $LIMBER_START_SHIFT; 0 where that
/// is not set. It simulates the different rounding of another processor, so that tests can show
/// that their assertions do not depend on last digits (scripts/test-machines).
/// @throws Error{kInvalidArgument, "LIMBER_START_SHIFT"} at every call, for a value that
/// parse_start_shift() refuses: a run without a shift must not pass for one with a shift
[[nodiscard]] double start_shift();

/// @throws Error{kInvalidArgument, "LIMBER_START_SHIFT"} unless `text` is a number from 0 to 1e-6
[[nodiscard]] double parse_start_shift(std::string_view text);

/// Numbers of [-share, share], the same in every call with the same count and share. Zeros are not
/// drawn. If the share is 0, no memory is allocated and the result is empty.
[[nodiscard]] Eigen::VectorXd start_moves(Eigen::Index count, double share = start_shift());

}  // namespace limber
