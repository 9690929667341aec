#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "engine/base/error.h"

namespace limber {

/// A small random generator (xoshiro256++ by Blackman and Vigna, seeded by SplitMix64). Its numbers
/// are the same on every machine and with every standard library: only IEEE operations and sqrt are
/// used.
class Random {
 public:
  explicit Random(std::uint64_t seed) {
    for (std::uint64_t& word : state_) {
      seed += 0x9e3779b97f4a7c15u;
      std::uint64_t z = seed;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
      word = z ^ (z >> 31);
    }
  }

  /// 64 random bits.
  std::uint64_t bits() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1), a multiple of 2^-53.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Standard normal, by Marsaglia's polar method.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    while (true) {
      const double x = uniform(-1, 1);
      const double y = uniform(-1, 1);
      const double square = x * x + y * y;
      if (square >= 1 || square == 0) continue;
      const double factor = std::sqrt(-2 * logarithm(square) / square);
      spare_ = y * factor;
      has_spare_ = true;
      return x * factor;
    }
  }

  /// Uniform in {0, ..., count - 1} without bias; count > 0.
  std::uint64_t index(std::uint64_t count) {
    LIMBER_DEMAND(count > 0);
    const std::uint64_t overhang = (0 - count) % count;  // 2^64 mod count
    while (true) {
      const std::uint64_t value = bits();
      if (value >= overhang) return value % count;
    }
  }

 private:
  // std::log differs in the last bit between C libraries. ln(m 2^e) = e ln 2 + 2 artanh((m - 1) /
  // (m + 1)).
  static double logarithm(double x) {
    int exponent = 0;
    double mantissa = std::frexp(x, &exponent);
    if (mantissa < 0.70710678118654752) {
      mantissa *= 2;
      --exponent;
    }
    const double s = (mantissa - 1) / (mantissa + 1);
    const double square = s * s;
    double sum = 0;
    for (int k = 25; k >= 1; k -= 2) sum = sum * square + 1.0 / k;
    return exponent * 0.69314718055994530942 + 2 * s * sum;
  }

  std::array<std::uint64_t, 4> state_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace limber
