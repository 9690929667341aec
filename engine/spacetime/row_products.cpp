#include "engine/spacetime/row_products.h"

namespace limber::spacetime {
namespace {

void add_product_of(const RowProducts& j, int term, const Lanes& d, Eigen::VectorXd& product) {
  product[j.rows.row_of(term)] +=
      lane_dot(j.jacobian.col(term).data(),
               d.col(j.systems.kept_of_knot(j.rows.knot_of(term))).data(), j.systems.lanes());
}

void add_transposed_of(const RowProducts& j, int term, const Eigen::VectorXd& m, Lanes& out) {
  lane_axpy(m[j.rows.row_of(term)], j.jacobian.col(term).data(),
            out.col(j.systems.kept_of_knot(j.rows.knot_of(term))).data(), j.systems.lanes());
}

}  // namespace

void RowProducts::multiply(const Lanes& d, Eigen::VectorXd& product) const {
  product.setZero(rows.count());
  for (int term = 0; term < rows.term_count(); ++term) add_product_of(*this, term, d, product);
}

void RowProducts::add_product(const std::vector<TermBlock>& blocks, const Lanes& d,
                              Eigen::VectorXd& product) const {
  for (const TermBlock& block : blocks)
    for (int term = block.first; term < block.first + block.count; ++term)
      add_product_of(*this, term, d, product);
}

void RowProducts::add_transposed(const Eigen::VectorXd& m, Lanes& out) const {
  for (int term = 0; term < rows.term_count(); ++term) add_transposed_of(*this, term, m, out);
}

void RowProducts::add_transposed(const std::vector<TermBlock>& blocks, const Eigen::VectorXd& m,
                                 Lanes& out) const {
  for (const TermBlock& block : blocks)
    for (int term = block.first; term < block.first + block.count; ++term)
      add_transposed_of(*this, term, m, out);
}

}  // namespace limber::spacetime
