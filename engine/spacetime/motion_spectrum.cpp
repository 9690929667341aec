#include "engine/spacetime/motion_spectrum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

/// Bins above a quarter of a cycle a frame, weighted so that their squares are part of the sum of
/// squares of the signal (Parseval): L x 2 bins.
Eigen::MatrixXd high_bins(int length) {
  const int first = length / 4 + 1, last = length / 2;
  Eigen::MatrixXd bins(length, 2 * (last - first + 1));
  for (int bin = first; bin <= last; ++bin) {
    const bool own_mirror = 2 * bin == length;
    const double weight = std::sqrt((own_mirror ? 1.0 : 2.0) / length);
    for (int n = 0; n < length; ++n) {
      const double angle = 2 * std::numbers::pi * ((bin * n) % length) / length;
      bins(n, 2 * (bin - first)) = weight * std::cos(angle);
      bins(n, 2 * (bin - first) + 1) = weight * std::sin(angle);
    }
  }
  return bins;
}

}  // namespace

std::optional<double> high_frequency_share(const Eigen::Ref<const Eigen::MatrixXd>& coordinates) {
  if (!coordinates.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "coordinates",
                "a motion has numbers that are not finite");
  }
  if (coordinates.cols() < kSpectrumMinFrames) return std::nullopt;
  const auto count = static_cast<int>(coordinates.cols()) - 1;
  const double largest = coordinates.size() > 0 ? coordinates.cwiseAbs().maxCoeff() : 0;
  if (largest == 0) return 0;
  const int length = std::min(kSpectrumSegment, count);
  const Eigen::MatrixXd bins = high_bins(length);
  Eigen::RowVectorXd window(length);
  for (int n = 0; n < length; ++n) {
    const double sine = std::sin(std::numbers::pi * (n + 0.5) / length);
    window[n] = sine * sine;
  }
  double high = 0, whole = 0;
  const auto add = [&](int first) {
    const Eigen::MatrixXd velocity =
        (coordinates.middleCols(first + 1, length) - coordinates.middleCols(first, length)) /
        largest * window.asDiagonal();
    high += (velocity * bins).squaredNorm();
    whole += velocity.squaredNorm();
  };
  int first = 0;
  for (; first + length < count; first += length / 4) add(first);
  add(count - length);
  // Velocities that are the rounding of positions are none.
  const double rounding = 8 * std::numeric_limits<double>::epsilon();
  if (whole <= rounding * rounding * static_cast<double>(coordinates.size())) return 0;
  return std::min(1.0, high / whole);
}

}  // namespace limber::spacetime
