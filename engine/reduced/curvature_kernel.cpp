#include "engine/reduced/kinematics_kernels.h"
#include "engine/reduced/rs_kernel.h"

namespace limber::reduced {
namespace {

using Vec = rotations::Pack<double>;
namespace stdx = rotations::stdx;
constexpr int kWidth = static_cast<int>(Vec::size());  // tets of one vector operation

/// q[9] = d (p . g) / d y, one lane per tet.
[[gnu::always_inline]] inline void pulled_back(const Vec* y, const Vec* p, Vec* q) {
  Vec rotation[9], unused[9];
  const auto k = rs_gradient_entries<Vec>(y, rotation, unused);
  Vec column[9];
  auto against_p = [&] {
    Vec sum = p[0] * column[0];
    for (int c = 1; c < 9; ++c) sum += p[c] * column[c];
    return sum;
  };
  rs_rotation_column<0, Vec>(k, y, column);
  q[0] = against_p();
  rs_rotation_column<1, Vec>(k, y, column);
  q[1] = against_p();
  rs_rotation_column<2, Vec>(k, y, column);
  q[2] = against_p();
  // d g / d s = R E: contract p with the columns of R; an entry off the diagonal occurs twice.
  for (int c = 3; c < 9; ++c) q[c] = Vec(0.0);
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      Vec sum = p[3 * j + i];
      for (int l = 0; l < 3; ++l) sum += p[3 * j + l] * rotation[3 * i + l];
      q[kStrainEntry[i][j]] += sum;
    }
  }
}

}  // namespace

void CurvatureWorkspace::add_tets(int padded, const double* y, const double* p) {
  // Strain enters g linearly, so all second derivatives have a rotation among them: three central
  // differences of the gradient along theta give them all.
  constexpr double kStep = 1e-5;
  second.resize(27 * Eigen::Index{padded});
  for (int t = 0; t < padded; t += kWidth) {
    Vec at[9], pull[9], above[9], below[9];
    for (int c = 0; c < 9; ++c) {
      at[c].copy_from(y + c * padded + t, stdx::element_aligned);
      pull[c].copy_from(p + c * padded + t, stdx::element_aligned);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const Vec centre = at[axis];
      at[axis] = centre + Vec(kStep);
      pulled_back(at, pull, above);
      at[axis] = centre - Vec(kStep);
      pulled_back(at, pull, below);
      at[axis] = centre;
      for (int c = 0; c < 9; ++c) {
        const Vec value = (above[c] - below[c]) * Vec(0.5 / kStep);
        value.copy_to(second.data() + (9 * axis + c) * padded + t, stdx::element_aligned);
      }
    }
  }
}

void CurvatureWorkspace::multiply(const TangentTables& tables) {
  // (K Y), K symmetric with the blocks theta-theta and theta-strain.
  const int padded = tables.padded;
  product.resize(tables.rows(), tables.rs_modes.cols());
  for (Eigen::Index k = 0; k < tables.rs_modes.cols(); ++k) {
    const double* modes = tables.rs_modes.col(k).data();
    double* out = product.col(k).data();
    for (int t = 0; t < padded; t += kWidth) {
      Vec m[9], sum[9];
#pragma GCC unroll 9
      for (int c = 0; c < 9; ++c) {
        m[c].copy_from(modes + c * padded + t, stdx::element_aligned);
        sum[c] = Vec(0.0);
      }
      // Unrolled, sums stay in registers.
#pragma GCC unroll 3
      for (int axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 9
        for (int c = 0; c < 9; ++c) {
          Vec entry;
          entry.copy_from(second.data() + (9 * axis + c) * padded + t, stdx::element_aligned);
          if (c < 3) {
            sum[c] += entry * m[axis];
          } else {
            sum[axis] += entry * m[c];
            sum[c] += entry * m[axis];
          }
        }
      }
#pragma GCC unroll 9
      for (int c = 0; c < 9; ++c) sum[c].copy_to(out + c * padded + t, stdx::element_aligned);
    }
  }
}

}  // namespace limber::reduced
