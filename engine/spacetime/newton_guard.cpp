#include "engine/spacetime/newton_guard.h"

#include <algorithm>

namespace limber::spacetime {
namespace {

/// The first shift, and the one below which it is dropped, relative to the curvature's norm.
constexpr double kSmallestShift = 1e-4;
constexpr double kLargestShift = 1e3;  // of the curvature's norm; above, the model is given up
constexpr double kCutShort = 0.1;      // share of a step; a smaller share is a cut step
constexpr int kCutsAllowed = 2;        // cut steps before the method changes
constexpr int kShortenedAllowed = 20;  // shortened steps before the method changes

}  // namespace

void NewtonGuard::set_curvature(double norm) {
  curvature_ = norm;
  if (method_ == Method::kPart) part_ = std::clamp(2 * part_, 0.25, 1.0);
}

bool NewtonGuard::strengthen() {
  if (method_ == Method::kPart) {
    if (part_ == 0) return false;  // weights too far apart for a squared system
    part_ = part_ > 0.1 ? 0.5 * part_ : 0;
    return true;
  }
  if (shift_ > 2 * curvature_) return false;
  raise_shift(4);
  return true;
}

void NewtonGuard::judge(double gain, double taken) {
  changed_ = false;
  if (method_ == Method::kPart) {
    if (gain > 0 && taken >= kCutShort) return;
    ++cut_;
    if (gain <= 0 || cut_ >= kCutsAllowed) begin(Method::kShift);
    return;
  }
  if (gain < 0.25 || taken < 1) {
    raise_shift(taken < 0.3 ? 8 : 3);
  } else if (gain > 0.6) {
    shift_ *= gain > 0.9 ? 0.1 : 0.3;
    if (shift_ < kSmallestShift * curvature_) shift_ = 0;
  }
  shortened_ = shift_ > 0 ? shortened_ + 1 : 0;
  if (shortened_ > kShortenedAllowed) begin(Method::kPart);
}

int NewtonGuard::attempts() const { return shift_may_grow() ? 3 : 30; }

bool NewtonGuard::may_retry() const { return changed_ || shift_may_grow(); }

bool NewtonGuard::shift_may_grow() const {
  return method_ == Method::kShift && shift_ < kLargestShift * curvature_;
}

void NewtonGuard::begin(Method method) {
  method_ = method;
  changed_ = true;
  part_ = 1;
  shift_ = 0;
  cut_ = shortened_ = 0;
}

void NewtonGuard::raise_shift(double factor) {
  shift_ = std::max(factor * shift_, kSmallestShift * curvature_);
}

}  // namespace limber::spacetime
