#pragma once

#include <Eigen/Core>
#include <string_view>

namespace limber {

/// Share by which solvers move the values that they start from: $LIMBER_START_SHIFT; 0 where that
/// is not set. It stands for last digits that another processor rounds otherwise, so that tests can
/// show that what they assert does not depend on them (scripts/test-machines).
/// @throws Error{kInvalidArgument, "LIMBER_START_SHIFT"} at every call, for a value that
/// parse_start_shift() refuses: a run that moves nothing must not pass for one that does
[[nodiscard]] double start_shift();

/// @throws Error{kInvalidArgument, "LIMBER_START_SHIFT"} for what is no number from 0 to 1e-6
[[nodiscard]] double parse_start_shift(std::string_view text);

/// Numbers of [-share, share], the same in every call with the same count and share. Zeros are not
/// drawn: nothing is allocated where the share is 0, and the result is empty.
[[nodiscard]] Eigen::VectorXd start_moves(Eigen::Index count, double share = start_shift());

}  // namespace limber
