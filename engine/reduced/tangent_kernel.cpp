#include "engine/base/error.h"
#include "engine/reduced/kinematics_kernels.h"
#include "engine/reduced/rs_kernel.h"

namespace limber::reduced {
namespace {

using Vec = rotations::Pack<double>;
namespace stdx = rotations::stdx;
constexpr int kWidth = static_cast<int>(Vec::size());  // tets of one vector operation

void load(const double* from, std::ptrdiff_t stride, Vec* to) {
  for (int c = 0; c < 9; ++c) to[c].copy_from(from + c * stride, stdx::element_aligned);
}
void store(const Vec* from, double* to, std::ptrdiff_t stride) {
  for (int c = 0; c < 9; ++c) from[c].copy_to(to + c * stride, stdx::element_aligned);
}

/// Row 9 t + c -> row c * padded + t.
Eigen::MatrixXd by_component(const Eigen::MatrixXd& by_tet, int tets, int padded) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(kRsSize * Eigen::Index{padded}, by_tet.cols());
  for (int t = 0; t < tets; ++t) {
    for (int c = 0; c < kRsSize; ++c) result.row(c * padded + t) = by_tet.row(kRsSize * t + c);
  }
  return result;
}

}  // namespace

TangentTables::TangentTables(const ReducedModel& model, const BaseMotion* base)
    : padded((model.cubature_size() + kWidth - 1) / kWidth * kWidth),
      rs_modes(by_component(model.rs_modes, model.cubature_size(), padded)) {
  if (base != nullptr) base_rs = by_component(base->rs, model.cubature_size(), padded);
}

SiteTables::SiteTables(const ReducedModel& model, const TangentTables& tables,
                       const Eigen::MatrixXd& basis_rows)
    : map(by_component((basis_rows * model.map).transpose(), model.cubature_size(), tables.padded)
              .transpose()),
      direct(basis_rows * model.direct),
      basis(basis_rows) {}

void TangentWorkspace::begin(const TangentTables& tables,
                             const Eigen::Ref<const Eigen::MatrixXd>& all_z,
                             std::span<const SiteQuery> queries) {
  slot.assign(static_cast<std::size_t>(all_z.cols()), -1);
  columns.clear();
  for (const SiteQuery& query : queries) {
    LIMBER_DEMAND(query.column >= 0 && query.column < all_z.cols());
    if (slot[query.column] >= 0) continue;
    slot[query.column] = static_cast<int>(columns.size());
    columns.push_back(query.column);
  }
  const auto count = static_cast<Eigen::Index>(columns.size());
  z.resize(all_z.rows(), count);
  for (Eigen::Index s = 0; s < count; ++s) z.col(s) = all_z.col(columns[s]);
  y.resize(tables.rows(), count);
  g.resize(tables.rows(), count);
}

void TangentWorkspace::evaluate(const TangentTables& tables, std::span<const int> frames,
                                const Eigen::Ref<const Eigen::MatrixXd>& all_z, bool derivatives) {
  (void)all_z;
  y.noalias() = tables.rs_modes * z;
  if (derivatives) {
    rotation.resize(tables.rows(), y.cols());
    spin.resize(3 * tables.rows(), y.cols());
  }
  const int stride = tables.padded;
  for (Eigen::Index s = 0; s < y.cols(); ++s) {
    if (tables.base_rs.size() > 0) y.col(s) += tables.base_rs.col(frames[columns[s]]);
    for (int t = 0; t < stride; t += kWidth) {
      Vec y_t[9], r_t[9], g_t[9];
      load(y.col(s).data() + t, stride, y_t);
      const auto k = rs_gradient_entries(y_t, r_t, g_t);
      store(g_t, g.col(s).data() + t, stride);
      if (!derivatives) continue;
      for (int e = 0; e < 9; e += 4) r_t[e] += 1.0;
      store(r_t, rotation.col(s).data() + t, stride);
      double* out = spin.col(s).data() + t;
      rs_rotation_column<0>(k, y_t, g_t);
      store(g_t, out, stride);
      rs_rotation_column<1>(k, y_t, g_t);
      store(g_t, out + std::ptrdiff_t{9} * stride, stride);
      rs_rotation_column<2>(k, y_t, g_t);
      store(g_t, out + std::ptrdiff_t{18} * stride, stride);
    }
  }
}

void TangentWorkspace::chain_rows(const TangentTables& tables, const SiteTables& site, int s,
                                  Eigen::Index first) {
  const int stride = tables.padded;
  for (int t = 0; t < stride; t += kWidth) {
    Vec m[3][9], out[3][9];
    for (int axis = 0; axis < 3; ++axis) load(site.map.row(axis).data() + t, stride, m[axis]);
    // Rotation columns: all nine entries of d g / d theta.
    for (int c = 0; c < 3; ++c) {
      Vec d[9];
      load(spin.col(s).data() + std::ptrdiff_t{9} * stride * c + t, stride, d);
      for (int axis = 0; axis < 3; ++axis) {
        Vec sum = m[axis][0] * d[0];
        for (int e = 1; e < 9; ++e) sum += m[axis][e] * d[e];
        out[axis][c] = sum;
      }
    }
    // Strain columns only pick columns of R: entry (i, j) of s puts column i of R into column j of
    // g.
    Vec r[9];
    load(rotation.col(s).data() + t, stride, r);
    for (int axis = 0; axis < 3; ++axis) {
      Vec pick[3][3];  // pick[i][j]: column j of m against column i of R
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          pick[i][j] = m[axis][3 * j] * r[3 * i] + m[axis][3 * j + 1] * r[3 * i + 1] +
                       m[axis][3 * j + 2] * r[3 * i + 2];
        }
      }
      out[axis][3] = pick[0][0];
      out[axis][4] = pick[1][1];
      out[axis][5] = pick[2][2];
      out[axis][6] = pick[1][2] + pick[2][1];
      out[axis][7] = pick[0][2] + pick[2][0];
      out[axis][8] = pick[0][1] + pick[1][0];
      store(out[axis], chain.row(first + axis).data() + t, stride);
    }
  }
}

}  // namespace limber::reduced
