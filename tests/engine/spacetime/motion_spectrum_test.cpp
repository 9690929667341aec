#include "engine/spacetime/motion_spectrum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;

RowVectorXd swing(int frames, double frequency, double phase = 0) {
  RowVectorXd x(frames);
  for (int i = 0; i < frames; ++i) x[i] = std::sin(2 * std::numbers::pi * frequency * i + phase);
  return x;
}

/// Mean power of the velocity of swing().
double power(double frequency) { return 2 * std::pow(std::sin(std::numbers::pi * frequency), 2); }

double share(const MatrixXd& x) { return high_frequency_share(x).value(); }

/// The same share from one transform of all velocities, without a window.
double share_without_window(const RowVectorXd& x) {
  const RowVectorXd v = x.tail(x.size() - 1) - x.head(x.size() - 1);
  const auto count = static_cast<int>(v.size());
  double high = 0;
  for (int bin = 0; bin < count; ++bin) {
    if (4 * std::min(bin, count - bin) <= count) continue;
    std::complex<double> sum = 0;
    for (int i = 0; i < count; ++i)
      sum += v[i] * std::polar(1.0, -2 * std::numbers::pi * bin * i / count);
    high += std::norm(sum) / count;
  }
  return high / v.squaredNorm();
}

TEST(MotionSpectrum, SlowSwingsHaveNoShareAndFastOnesAllOfIt) {
  for (const int frames : {40, 64, 65, 66, 200, 621}) {
    for (const double phase : {0.0, 0.7, 1.6}) {
      for (const double frequency : {1.0 / 60, 1.0 / 24, 1.0 / 10, 1.0 / 8}) {
        // What leaks as many bins away as a quarter of a cycle a frame is.
        const double bins = std::min(kSpectrumSegment, frames - 1) * (0.25 - frequency);
        EXPECT_LT(share(swing(frames, frequency, phase)), std::pow(bins, -6))
            << frames << " " << frequency;
      }
      EXPECT_GT(share(swing(frames, 0.4, phase)), 1 - 1e-4) << frames;
      EXPECT_GT(share(swing(frames, 0.5, phase + 0.8)), 1 - 1e-4) << frames;
    }
  }
}

TEST(MotionSpectrum, TwoSwingsShareAsTheirPowers) {
  const double slow = 1.0 / 31, fast = 0.37;
  for (const double amplitude : {1.0, 0.1, 1e-3}) {
    const MatrixXd together = swing(300, slow) + amplitude * swing(300, fast);
    const double high = amplitude * amplitude * power(fast);
    EXPECT_NEAR(share(together), high / (high + power(slow)), 0.02 * high / (high + power(slow)));
    // In two coordinates instead of one.
    MatrixXd apart(2, 300);
    apart << swing(300, slow), amplitude * swing(300, fast);
    EXPECT_NEAR(share(apart), high / (high + power(slow)), 0.02 * high / (high + power(slow)));
  }
}

TEST(MotionSpectrum, AJumpBetweenTheEndsOfTheMotionIsNoHighFrequency) {
  const RowVectorXd x = swing(200, 1.0 / 57, 1.1);  // not whole periods: velocity jumps
  EXPECT_GT(share_without_window(x), 1e-3);
  EXPECT_LT(share(x), 1e-7);
  RowVectorXd drift(200);
  for (int i = 0; i < 200; ++i) drift[i] = 3 + 0.2 * i + 1e-3 * i * i;
  EXPECT_LT(share(drift), 1e-7);
}

TEST(MotionSpectrum, AShakeOfAFewFramesIsDetectedAnywhere) {
  for (const int at : {4, 60, 100, 192}) {
    RowVectorXd x = swing(200, 1.0 / 50);
    for (int i = 0; i < 6; ++i) x[at + i] += (i % 2 == 0 ? 0.05 : -0.05);
    EXPECT_GT(share(x), 1e-4) << at;
  }
}

TEST(MotionSpectrum, DoesNotDependOnScale) {
  const RowVectorXd x = swing(100, 1.0 / 20) + 0.1 * swing(100, 0.3);
  EXPECT_NEAR(share(1e-9 * x), share(x), 1e-12);
  EXPECT_NEAR(share(1e12 * x), share(x), 1e-12);
}

TEST(MotionSpectrum, SizesMultiplyRows) {
  for (const int frames : {40, 64, 65, 200}) {
    MatrixXd x(2, frames);
    x << swing(frames, 1.0 / 20), swing(frames, 0.3, 0.4);
    const Eigen::Vector2d sizes(2.5, 0.04);
    EXPECT_NEAR(high_frequency_share(x, sizes).value(), share(sizes.asDiagonal() * x), 1e-12);
  }
}

/// The definition, term by term: windowed segments and all bins above a quarter of a cycle.
TEST(MotionSpectrum, IsThePowerOfHighBinsOfSegments) {
  for (const int frames : {18, 19, 20, 21, 65, 66, 150}) {
    const RowVectorXd x = swing(frames, 1.0 / 9) + 0.4 * swing(frames, 0.31, 0.2);
    const int count = frames - 1, length = std::min(kSpectrumSegment, count);
    double high = 0, whole = 0;
    const auto add = [&](int first) {
      RowVectorXd v = x.segment(first + 1, length) - x.segment(first, length);
      for (int i = 0; i < length; ++i)
        v[i] *= std::pow(std::sin(std::numbers::pi * (i + 0.5) / length), 2);
      for (int bin = 0; bin < length; ++bin) {
        if (4 * std::min(bin, length - bin) <= length) continue;
        std::complex<double> sum = 0;
        for (int i = 0; i < length; ++i)
          sum += v[i] * std::polar(1.0, -2 * std::numbers::pi * bin * i / length);
        high += std::norm(sum) / length;
      }
      whole += v.squaredNorm();
    };
    int first = 0;
    for (; first + length < count; first += length / 4) add(first);
    add(count - length);
    EXPECT_NEAR(share(x), high / whole, 1e-12) << frames;
  }
}

TEST(MotionSpectrum, AMotionAtRestOrTooShort) {
  EXPECT_EQ(share(MatrixXd::Zero(3, 50)), 0);
  EXPECT_EQ(share(MatrixXd::Constant(3, 50, 0.3)), 0);
  EXPECT_EQ(share(MatrixXd(0, 50)), 0);
  EXPECT_FALSE(high_frequency_share(MatrixXd::Ones(3, kSpectrumMinFrames - 1)));
  EXPECT_TRUE(high_frequency_share(MatrixXd::Ones(3, kSpectrumMinFrames)));
}

TEST(MotionSpectrum, RefusesWhatIsNotFinite) {
  MatrixXd x = MatrixXd::Zero(2, 30);
  x(1, 7) = std::nan("");
  EXPECT_THROW(static_cast<void>(high_frequency_share(x)), Error);
}

}  // namespace
}  // namespace limber::spacetime
