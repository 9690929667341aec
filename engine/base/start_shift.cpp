#include "engine/base/start_shift.h"

#include <cstdint>
#include <cstdlib>
#include <string>

#include "engine/base/checked_number.h"
#include "engine/base/error.h"
#include "engine/base/random.h"

namespace limber {
namespace {

constexpr double kMaximalShift = 1e-6;

double shift_of_environment() {
  const char* text = std::getenv("LIMBER_START_SHIFT");
  return text == nullptr ? 0 : parse_start_shift(text);
}

}  // namespace

double parse_start_shift(std::string_view text) {
  const auto value = parse_number<double>(text);
  if (!value || !(*value >= 0 && *value <= kMaximalShift))
    throw Error(ErrorCode::kInvalidArgument, "LIMBER_START_SHIFT",
                "LIMBER_START_SHIFT is '" + std::string(text) +
                    "': a number from 0 to 1e-6 is expected, or nothing set");
  return *value;
}

double start_shift() {
  static const double shift = shift_of_environment();
  return shift;
}

Eigen::VectorXd start_moves(Eigen::Index count, double share) {
  if (share == 0) return {};
  Random random(static_cast<std::uint64_t>(count));
  Eigen::VectorXd moves(count);
  for (double& move : moves) move = random.uniform(-share, share);
  return moves;
}

}  // namespace limber
