#pragma once

#include <charconv>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

/// The only way from a number of an input (file, message, setting) to an integer type. A cast cuts
/// off what the type cannot hold: 2^32 becomes 0 and passes every check behind it.
/// tests/architecture/conversions.py refuses casts and other conversions in readers.
namespace limber {

/// @returns `value`; empty if `To` cannot hold it, or if it is not a whole number
template <std::integral To, class From>
requires std::is_arithmetic_v<From>
[[nodiscard]] constexpr std::optional<To> to_whole(From value) noexcept {
  if constexpr (std::is_floating_point_v<From>) {
    // Both bounds are powers of two (or 0), so that they are exact.
    constexpr From kLeast = static_cast<From>(std::numeric_limits<To>::min());
    constexpr To kWholeHalf = std::numeric_limits<To>::max() / 2 + 1;
    constexpr From kHalf = static_cast<From>(kWholeHalf);
    if (!(value >= kLeast && value / 2 < kHalf) || value != std::trunc(value)) return std::nullopt;
  } else {
    if (!std::in_range<To>(value)) return std::nullopt;
  }
  return static_cast<To>(value);
}

/// @returns the number in `text`: decimal digits, only a minus is allowed before them. Empty if it
/// is not a number, or if `Number` cannot hold it
template <class Number>
requires std::is_arithmetic_v<Number>
[[nodiscard]] std::optional<Number> parse_number(std::string_view text) noexcept {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end) return std::nullopt;
  return value;
}

}  // namespace limber
