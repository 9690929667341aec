#pragma once

#include <cmath>
#include <concepts>

namespace limber {

/// A number and its derivative along one direction (forward differentiation, exact). V: double, a
/// SIMD pack, or another Dual. Kernels written for a scalar type V give with Dual<V> the derivative
/// of their result, so that Hessian-vector products and third derivatives need no code of their
/// own. Comparisons are left out on purpose: branches go by `value`.
template <class V>
struct Dual {
  V value = V(0.0);
  V derivative = V(0.0);

  Dual() = default;
  template <class T>
  requires std::convertible_to<T, V> Dual(const T& constant)
      : value(constant), derivative(0.0) {}  // NOLINT: constants mix freely
  Dual(const V& v, const V& d) : value(v), derivative(d) {}

  Dual& operator+=(const Dual& other) { return *this = *this + other; }
  Dual& operator-=(const Dual& other) { return *this = *this - other; }
  Dual& operator*=(const Dual& other) { return *this = *this * other; }

  [[gnu::always_inline]] friend inline Dual operator-(const Dual& a) {
    return {-a.value, -a.derivative};
  }
  [[gnu::always_inline]] friend inline Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.derivative + b.derivative};
  }
  [[gnu::always_inline]] friend inline Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.derivative - b.derivative};
  }
  [[gnu::always_inline]] friend inline Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.derivative * b.value + a.value * b.derivative};
  }
  [[gnu::always_inline]] friend inline Dual operator/(const Dual& a, const Dual& b) {
    const V inverse = V(1.0) / b.value;
    const V quotient = a.value * inverse;
    return {quotient, (a.derivative - quotient * b.derivative) * inverse};
  }
  [[gnu::always_inline]] friend inline Dual sqrt(const Dual& a) {
    using std::sqrt;
    const V root = sqrt(a.value);
    return {root, a.derivative / (root + root)};
  }
};

}  // namespace limber
