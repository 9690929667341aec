#pragma once

#include <vector>

#include "engine/spacetime/lanes.h"

namespace limber::spacetime {

/// Rows of a least-squares operator over the kept frames, at most `width` neighbours wide, one
/// matrix per lane, all lanes with the same pattern. Sorted by start.
struct BandedRow {
  int start = 0;
  Lanes values;  // lanes x width, 4 or 6, of all rows; entries past the last column are zero
};

/// y = sum over rows: L z, and L^T L z.
void apply_normal(const std::vector<BandedRow>& rows, const Lanes& z, Lanes& product);
/// 1/2 |L z|^2 over all lanes.
[[nodiscard]] double half_square(const std::vector<BandedRow>& rows, const Lanes& z);

/// R of the QR of [L; sqrt(shift) I], width - 1 superdiagonals, by inserting rows with Givens
/// rotations.
class BandedFactor {
 public:
  /// @param width  of the rows, 4 or 6
  void factor(const std::vector<BandedRow>& rows, int width, int columns, int lanes, double shift);
  /// x <- (L^T L + shift I)^-1 x, lanes x columns.
  void solve(Lanes& x) const;
  /// Column `column` of the inverse, every lane: x is lanes x columns.
  void inverse_column(int column, Lanes& x) const;
  /// Of that column the number on the diagonal: lanes.
  void inverse_diagonal(int column, Eigen::VectorXd& own) const;

 private:
  void insert(int start, double* row);
  template <int kWidth>
  void insert_row(int start, double* row);
  template <int kWidth>
  void forward(Lanes& x, int from) const;
  template <int kWidth>
  void backward(Lanes& x) const;
  [[nodiscard]] std::size_t place(int column) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(width_) *
           static_cast<std::size_t>(lanes_);
  }
  /// x <- R^-T x; nothing above column `from` in x.
  void forward_substitute(Lanes& x, int from) const;
  void back_substitute(Lanes& x) const;

  int width_ = 4, columns_ = 0, lanes_ = 0;
  std::vector<double> r_;       // [column][1/diagonal, width - 1 superdiagonals][lane]
  std::vector<char> occupied_;  // columns whose row of R is not empty
};

}  // namespace limber::spacetime
