#pragma once

#include <cstddef>

namespace limber {

/// Converts a number that is known not to be negative, for containers of the standard library.
[[nodiscard]] constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace limber
