#include "engine/session/bodies/mode_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "engine/base/error.h"

namespace limber::session {
namespace {

template <class T>
void require(bool holds, const char* member, T value, const char* inequality) {
  if (holds) return;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("mode_choice.{}", member),
              fmt::format("ModeChoiceOptions::{} = {}, must be {}", member, value, inequality));
}

}  // namespace

void ModeChoiceOptions::validate() const {
  require(growth > 1 && growth <= 10, "growth", growth, "in (1, 10]");
  require(least > 0, "least", least, "> 0");
  require(most >= least, "most", most, ">= least");
  require(shrink_share > 0 && shrink_share < 1, "shrink_share", shrink_share, "in (0, 1)");
  require(energy_factor > 1, "energy_factor", energy_factor, "> 1");
  require(most_tets >= 0, "most_tets", most_tets, ">= 0");
  require(most_frames >= 0, "most_frames", most_frames, ">= 0");
  require(most_tet_readings >= 0, "most_tet_readings", most_tet_readings, ">= 0");
}

double energy_saving(double fewer, double more) {
  constexpr double kNothing = std::numeric_limits<double>::min();
  return (fewer - more) / std::max(kNothing, std::max(more, 1e-12 * fewer));
}

}  // namespace limber::session
