#pragma once

namespace limber::bodies {

/// What a force is multiplied by while it acts, t seconds after it began.
enum class ForceProfile {
  kConstant,  // 1
  kRamp,      // t / (until - from): from nothing to all of it
  kSine,      // sin(2 pi t / period)
};

}  // namespace limber::bodies
