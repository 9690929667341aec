#include "engine/reduced/kinematics_kernels.h"
#include "engine/reduced/rs_kernel.h"

namespace limber::reduced {
namespace {

using Vec = rotations::Pack<float>;
namespace stdx = rotations::stdx;
constexpr int kWidth = static_cast<int>(Vec::size());  // tets of one vector operation
static_assert(StreamTables::kBlock % kWidth == 0);

/// Column 9 t + c -> column c * T + t, in single precision.
Eigen::MatrixXf component_rows(const Eigen::MatrixXd& by_tet, int tets) {
  Eigen::MatrixXf result(by_tet.rows(), by_tet.cols());
  for (int t = 0; t < tets; ++t) {
    for (int c = 0; c < kRsSize; ++c)
      result.col(c * tets + t) = by_tet.col(kRsSize * t + c).cast<float>();
  }
  return result;
}

/// H g'(0) Y for RS coordinates Y of the cubature tets (9T x k).
Eigen::MatrixXd linear_image(const ReducedModel& model, const Eigen::MatrixXd& rs) {
  Eigen::MatrixXd linear(rs.rows(), rs.cols());
  for (Eigen::Index k = 0; k < rs.cols(); ++k) {
    for (Eigen::Index row = 0; row < rs.rows(); row += kRsSize) {
      const Eigen::Matrix3d h = linear_gradient(rs.col(k).segment<kRsSize>(row));
      linear.col(k).segment<kRsSize>(row) = Eigen::Map<const RsVector>(h.data());
    }
  }
  return model.map * linear;
}

}  // namespace

StreamTables::StreamTables(const ReducedModel& model, const BaseMotion* base)
    : tets(model.cubature_size()),
      rs_modes_transposed(component_rows(model.rs_modes.transpose(), tets)),
      map(component_rows(model.map, tets)),
      direct((model.direct + linear_image(model, model.rs_modes)).cast<float>()) {
  if (base == nullptr) return;
  base_rs_transposed = component_rows(base->rs.transpose(), tets);
  base_q = (base->direct + linear_image(model, base->rs)).cast<float>();
}

void StreamWorkspace::evaluate(const StreamTables& tables, int first,
                               const Eigen::Ref<const Eigen::MatrixXd>& all_z,
                               Eigen::Ref<Eigen::MatrixXf> q) {
  const Eigen::Index n = all_z.cols();
  const Eigen::Index lanes = (n + kWidth - 1) / kWidth * kWidth;
  z.resize(all_z.rows(), StreamTables::kBlock);
  y.resize(StreamTables::kBlock, tables.rs_modes_transposed.cols());
  z.leftCols(n) = all_z.cast<float>();
  z.middleCols(n, lanes - n).setZero();
  y.topRows(lanes).noalias() = z.leftCols(lanes).transpose() * tables.rs_modes_transposed;
  if (tables.base_q.size() > 0) y.topRows(n) += tables.base_rs_transposed.middleRows(first, n);
  const std::ptrdiff_t stride = std::ptrdiff_t{StreamTables::kBlock} * tables.tets;
  for (int t = 0; t < tables.tets; ++t) {
    float* from = y.data() + std::ptrdiff_t{StreamTables::kBlock} * t;
    for (Eigen::Index i = 0; i < lanes; i += kWidth) {
      Vec y_i[9], r_i[9];
      for (int c = 0; c < 9; ++c) y_i[c].copy_from(from + c * stride + i, stdx::element_aligned);
      rs_remainder_entries(y_i, r_i);
      for (int c = 0; c < 9; ++c) r_i[c].copy_to(from + c * stride + i, stdx::element_aligned);
    }
  }
  q.noalias() = tables.map * y.topRows(n).transpose();
  q.noalias() += tables.direct * z.leftCols(n);
  if (tables.base_q.size() > 0) q += tables.base_q.middleCols(first, n);
}

}  // namespace limber::reduced
