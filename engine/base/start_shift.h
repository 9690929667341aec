#pragma once

#include <Eigen/Core>

namespace limber {

/// Share by which solvers move the values that they start from: $LIMBER_START_SHIFT, 0 to 1e-6,
/// else 0. It stands for last digits that another processor rounds otherwise, so that tests can
/// show that what they assert does not depend on them (scripts/test-machines).
[[nodiscard]] double start_shift() noexcept;

/// Numbers of [-start_shift(), start_shift()], the same in every call with the same count. Zeros
/// are not drawn: nothing is allocated where the share is 0, and the result is empty.
[[nodiscard]] Eigen::VectorXd start_moves(Eigen::Index count);

}  // namespace limber
