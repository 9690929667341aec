#pragma once

#include <numbers>

namespace limber {

inline constexpr double kDegree = std::numbers::pi / 180;  // [rad]
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
inline constexpr double kFullTurn = 2 * std::numbers::pi;  // [rad]

}  // namespace limber
