#include "engine/session/linkages/unit_name.h"

#include <fmt/format.h>

namespace limber::session {

std::string unit_name(double length_unit_in_metres) {
  if (length_unit_in_metres == 1) return "m";
  if (length_unit_in_metres == 0.01) return "cm";
  if (length_unit_in_metres == 0.001) return "mm";
  return fmt::format("units of {:g} m", length_unit_in_metres);
}

}  // namespace limber::session
