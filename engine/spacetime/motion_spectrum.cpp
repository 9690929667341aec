#include "engine/spacetime/motion_spectrum.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"

namespace limber::spacetime {
namespace {

/// Bins above a quarter of a cycle a frame of a real signal x of L frames. They are weighted so
/// that their squares are part of the signal's sum of squares (Parseval). Cosines are the same n
/// frames from either end of the segment and sines opposite: they are applied to x_n + x_{L-n} and
/// x_n - x_{L-n}.
class HighBins {
 public:
  explicit HighBins(int length) : pairs_((length - 1) / 2), has_middle_(length % 2 == 0) {
    const int first = length / 4 + 1, last = length / 2;
    cosines_.resize(pairs_ + (has_middle_ ? 2 : 1), last - first + 1);
    sines_.resize(pairs_, last - first + 1);
    for (int bin = first; bin <= last; ++bin) {
      const bool own_mirror = 2 * bin == length;
      const double weight = std::sqrt((own_mirror ? 1.0 : 2.0) / length);
      for (int n = 0; n < cosines_.rows(); ++n) {
        const double angle = 2 * std::numbers::pi * ((bin * n) % length) / length;
        cosines_(n, bin - first) = weight * std::cos(angle);
        if (n > 0 && n <= pairs_) sines_(n - 1, bin - first) = weight * std::sin(angle);
      }
    }
  }

  /// Sum of squares in these bins of the rows of x, each a signal.
  [[nodiscard]] double power(const Eigen::MatrixXd& x) const {
    const auto front = x.middleCols(1, pairs_);
    const auto back = x.rightCols(pairs_).rowwise().reverse();
    Eigen::MatrixXd even(x.rows(), cosines_.rows());
    even.col(0) = x.col(0);
    even.middleCols(1, pairs_) = front + back;
    if (has_middle_) even.col(pairs_ + 1) = x.col(pairs_ + 1);
    const Eigen::MatrixXd odd = front - back;
    return (even * cosines_).squaredNorm() + (odd * sines_).squaredNorm();
  }

 private:
  int pairs_;
  bool has_middle_;
  Eigen::MatrixXd cosines_, sines_;
};

}  // namespace

std::optional<double> high_frequency_share(const Eigen::Ref<const Eigen::MatrixXd>& coordinates) {
  return high_frequency_share(coordinates, Eigen::VectorXd::Ones(coordinates.rows()));
}

std::optional<double> high_frequency_share(const Eigen::Ref<const Eigen::MatrixXd>& coordinates,
                                           const Eigen::Ref<const Eigen::VectorXd>& sizes) {
  LIMBER_DEMAND(sizes.size() == coordinates.rows());
  if (!coordinates.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "coordinates",
                "a motion has numbers that are not finite");
  }
  if (coordinates.cols() < kSpectrumMinFrames) return std::nullopt;
  const auto count = static_cast<int>(coordinates.cols()) - 1;
  Eigen::VectorXd peaks = Eigen::VectorXd::Zero(coordinates.rows());
  for (const auto& frame : coordinates.colwise()) peaks = peaks.cwiseMax(frame.cwiseAbs());
  const double largest = sizes.size() > 0 ? sizes.cwiseAbs().cwiseProduct(peaks).maxCoeff() : 0;
  if (largest == 0) return 0;
  const int length = std::min(kSpectrumSegment, count);
  const HighBins bins(length);
  Eigen::RowVectorXd window(length);
  for (int n = 0; n < length; ++n) {
    const double sine = std::sin(std::numbers::pi * (n + 0.5) / length);
    window[n] = sine * sine;
  }
  std::vector<int> starts;
  for (int first = 0; first + length < count; first += length / 4) starts.push_back(first);
  starts.push_back(count - length);
  const Eigen::VectorXd scale = sizes / largest;
  std::vector<double> high(starts.size()), whole(starts.size());
  constexpr std::int64_t kSegmentsAtOnce = 64;
  parallel_for(static_cast<std::int64_t>(starts.size()), kSegmentsAtOnce,
               [&](std::int64_t begin, std::int64_t end) {
                 for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end);
                      ++i) {
                   const Eigen::MatrixXd velocity = scale.asDiagonal() *
                                                    (coordinates.middleCols(starts[i] + 1, length) -
                                                     coordinates.middleCols(starts[i], length)) *
                                                    window.asDiagonal();
                   high[i] = bins.power(velocity);
                   whole[i] = velocity.squaredNorm();
                 }
               });
  const double power = std::accumulate(whole.begin(), whole.end(), 0.0);
  // Velocities that are the rounding of positions are none.
  const double rounding = 8 * std::numeric_limits<double>::epsilon();
  if (power <= rounding * rounding * static_cast<double>(coordinates.size())) return 0;
  return std::min(1.0, std::accumulate(high.begin(), high.end(), 0.0) / power);
}

}  // namespace limber::spacetime
