#pragma once

#include <string>

namespace limber::session {

/// The scene's unit of length in messages: "m", "mm", "units of 0.0254 m".
[[nodiscard]] std::string unit_name(double length_unit_in_metres);

}  // namespace limber::session
