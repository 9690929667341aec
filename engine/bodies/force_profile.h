#pragma once

namespace limber::bodies {

/// The factor of a force while it acts, t seconds after it began.
enum class ForceProfile {
  kConstant,  // 1
  kRamp,      // t / (until - from): from zero to the full force
  kSine,      // sin(2 pi t / period)
};

}  // namespace limber::bodies
