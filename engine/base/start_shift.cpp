#include "engine/base/start_shift.h"

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "engine/base/random.h"

namespace limber {
namespace {

constexpr double kMaximalShift = 1e-6;

double shift_of_environment() {
  const char* text = std::getenv("LIMBER_START_SHIFT");
  if (text == nullptr) return 0;
  double value = 0;
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  if (error != std::errc() || rest != end || !(value >= 0 && value <= kMaximalShift)) return 0;
  return value;
}

}  // namespace

double start_shift() noexcept {
  static const double shift = shift_of_environment();
  return shift;
}

Eigen::VectorXd start_moves(Eigen::Index count) {
  const double shift = start_shift();
  if (shift == 0) return {};
  Random random(static_cast<std::uint64_t>(count));
  Eigen::VectorXd moves(count);
  for (double& move : moves) move = random.uniform(-shift, shift);
  return moves;
}

}  // namespace limber
