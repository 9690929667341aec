#pragma once

#include <cmath>

// Three numbers of any scalar type V (double, SIMD pack, Dual) for kernels. Eigen's types with a
// pack as scalar do not vectorise reliably; these are plain and always inlined.

namespace limber {

template <class V>
struct Vec3 {
  V x = V(0.0);
  V y = V(0.0);
  V z = V(0.0);

  [[gnu::always_inline]] inline Vec3& operator+=(const Vec3& o) { return *this = *this + o; }
  [[gnu::always_inline]] inline Vec3& operator-=(const Vec3& o) { return *this = *this - o; }

  [[gnu::always_inline]] friend inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  [[gnu::always_inline]] friend inline Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  [[gnu::always_inline]] friend inline Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  [[gnu::always_inline]] friend inline Vec3 operator*(const V& s, const Vec3& a) {
    return {s * a.x, s * a.y, s * a.z};
  }
};

template <class V>
[[gnu::always_inline]] inline V dot(const Vec3<V>& a, const Vec3<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
[[gnu::always_inline]] inline Vec3<V> cross(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
[[gnu::always_inline]] inline V norm(const Vec3<V>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

/// A 3 x 3 matrix by its columns.
template <class V>
struct Mat3 {
  Vec3<V> column[3];

  [[gnu::always_inline]] friend inline Mat3 operator+(const Mat3& a, const Mat3& b) {
    return {{a.column[0] + b.column[0], a.column[1] + b.column[1], a.column[2] + b.column[2]}};
  }
  [[gnu::always_inline]] friend inline Vec3<V> operator*(const Mat3& a, const Vec3<V>& v) {
    return v.x * a.column[0] + v.y * a.column[1] + v.z * a.column[2];
  }
};

template <class V>
[[gnu::always_inline]] inline Mat3<V> transpose(const Mat3<V>& a) {
  const auto& [p, q, r] = a.column;
  return {{{p.x, q.x, r.x}, {p.y, q.y, r.y}, {p.z, q.z, r.z}}};
}
/// a^T b, a number; a b^T, a matrix.
template <class V>
[[gnu::always_inline]] inline Mat3<V> outer(const Vec3<V>& a, const Vec3<V>& b) {
  return {{b.x * a, b.y * a, b.z * a}};
}
/// a^x m: every column crossed from the left.
template <class V>
[[gnu::always_inline]] inline Mat3<V> cross(const Vec3<V>& a, const Mat3<V>& m) {
  return {{cross(a, m.column[0]), cross(a, m.column[1]), cross(a, m.column[2])}};
}

/// A symmetric 3 x 3 matrix by its lower triangle.
template <class V>
struct Sym3 {
  V xx = V(0.0);
  V yx = V(0.0);
  V yy = V(0.0);
  V zx = V(0.0);
  V zy = V(0.0);
  V zz = V(0.0);

  [[gnu::always_inline]] inline Sym3& operator+=(const Sym3& o) { return *this = *this + o; }

  [[gnu::always_inline]] friend inline Sym3 operator+(const Sym3& a, const Sym3& b) {
    return {a.xx + b.xx, a.yx + b.yx, a.yy + b.yy, a.zx + b.zx, a.zy + b.zy, a.zz + b.zz};
  }
  [[gnu::always_inline]] friend inline Sym3 operator-(const Sym3& a, const Sym3& b) {
    return {a.xx - b.xx, a.yx - b.yx, a.yy - b.yy, a.zx - b.zx, a.zy - b.zy, a.zz - b.zz};
  }
  [[gnu::always_inline]] friend inline Sym3 operator*(const V& s, const Sym3& a) {
    return {s * a.xx, s * a.yx, s * a.yy, s * a.zx, s * a.zy, s * a.zz};
  }
  [[gnu::always_inline]] friend inline Vec3<V> operator*(const Sym3& a, const Vec3<V>& v) {
    return {a.xx * v.x + a.yx * v.y + a.zx * v.z, a.yx * v.x + a.yy * v.y + a.zy * v.z,
            a.zx * v.x + a.zy * v.y + a.zz * v.z};
  }
};

/// a a^T
template <class V>
[[gnu::always_inline]] inline Sym3<V> square(const Vec3<V>& a) {
  return {a.x * a.x, a.y * a.x, a.y * a.y, a.z * a.x, a.z * a.y, a.z * a.z};
}
/// a b^T + b a^T
template <class V>
[[gnu::always_inline]] inline Sym3<V> symmetric_product(const Vec3<V>& a, const Vec3<V>& b) {
  const V x = a.x * b.x, y = a.y * b.y, z = a.z * b.z;
  return {x + x, a.y * b.x + a.x * b.y, y + y, a.z * b.x + a.x * b.z, a.z * b.y + a.y * b.z, z + z};
}
template <class V>
[[gnu::always_inline]] inline Sym3<V> scaled_identity(const V& s) {
  return {s, V(0.0), s, V(0.0), V(0.0), s};
}
template <class V>
[[gnu::always_inline]] inline Mat3<V> full(const Sym3<V>& a) {
  return {{{a.xx, a.yx, a.zx}, {a.yx, a.yy, a.zy}, {a.zx, a.zy, a.zz}}};
}

}  // namespace limber
