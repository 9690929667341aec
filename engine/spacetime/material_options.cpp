#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/material_solver.h"

namespace limber::spacetime {
namespace {

[[noreturn]] void refuse_option(const char* field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

}  // namespace

void MaterialOptions::validate() const {
  if (!(column_weight >= 0) || !std::isfinite(column_weight))
    refuse_option("options.column_weight",
                  fmt::format("options.column_weight = {} must be >= 0", column_weight));
  if (!(tolerance > 0) || !(tolerance < 1))
    refuse_option("options.tolerance",
                  fmt::format("options.tolerance = {} must be in (0, 1)", tolerance));
  if (max_iterations <= 0)
    refuse_option("options.max_iterations",
                  fmt::format("options.max_iterations = {} must be > 0", max_iterations));
  const auto check_frequency = [](const char* field, double frequency) {
    if (!(frequency > 0) || !(frequency <= 0.5))
      refuse_option(field, fmt::format("{} = {} must be in (0, 0.5]", field, frequency));
  };
  check_frequency("options.max_frequency", max_frequency);
  check_frequency("options.slow_frequency", slow_frequency);
  if (slow_steps < 0)
    refuse_option("options.slow_steps",
                  fmt::format("options.slow_steps = {} must be >= 0", slow_steps));
  if (held < 0) refuse_option("options.held", fmt::format("options.held = {} must be >= 0", held));
}

double slow_frequency_of(const ModeDynamics& dynamics, int held) {
  if (held >= dynamics.stiffness.size() || !(dynamics.stiffness[held] > 0))
    return MaterialOptions::kSlowestNeeded;
  return std::min(MaterialOptions::kSlowestNeeded,
                  frequency_of(dynamics.stiffness[held], dynamics.discretisation));
}

}  // namespace limber::spacetime
