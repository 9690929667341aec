#pragma once

namespace limber {

/// Signs of the pivots of an elimination without exchanges: the matrix has as many positive and
/// negative eigenvalues (Sylvester).
struct PivotCount {
  int positive = 0;
  int negative = 0;
  /// Pivots that are rounding noise compared with their diagonal entry (or not finite): the matrix
  /// is singular, solutions are meaningless.
  int vanishing = 0;

  [[nodiscard]] bool positive_definite() const { return negative == 0 && vanishing == 0; }

  PivotCount& operator+=(const PivotCount& other) {
    positive += other.positive;
    negative += other.negative;
    vanishing += other.vanishing;
    return *this;
  }
  friend bool operator==(const PivotCount&, const PivotCount&) = default;
};

/// A pivot below this share of its diagonal entry is rounding noise.
inline constexpr double kVanishingPivot = 1e-14;

}  // namespace limber
