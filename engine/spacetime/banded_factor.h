#pragma once

#include <vector>

#include "engine/spacetime/lanes.h"

namespace limber::spacetime {

/// Rows of a least-squares operator over the kept frames, at most `width` neighbours wide, one
/// matrix per lane, all lanes with the same pattern. Sorted by start.
struct BandedRow {
  int start = 0;
  Lanes values;  // lanes x width, 4 or 6, of all rows; entries past the last column are zero
  /// For a row over the seam of a cycle (start = 0): lanes x width / 2, its entries in the last
  /// columns. Empty for other rows.
  Lanes behind = {};
};

/// y = sum over rows: L z, and L^T L z.
void apply_normal(const std::vector<BandedRow>& rows, const Lanes& z, Lanes& product);
/// 1/2 |L z|^2 over all lanes.
[[nodiscard]] double half_square(const std::vector<BandedRow>& rows, const Lanes& z);

/// Whether the rows are those of a cycle, which come around to the last columns.
enum class Shape { kBand, kCycle };

/// R of the QR of [L; sqrt(shift) I], width - 1 superdiagonals, by inserting rows with Givens
/// rotations. In a cycle, the last width / 2 columns (the border) are filled as well:
///
///    [ b b b     | x x ]
///    [   b b b   | x x ]        b: band, x: border
///    [     b b b | x x ]
///    [           | t t ]        t: the rest, the end of the band
///    [           |   t ]
class BandedFactor {
 public:
  /// @param width  of the rows, 4 or 6
  void factor(const std::vector<BandedRow>& rows, int width, int columns, int lanes, double shift,
              Shape shape = Shape::kBand);
  /// x <- (L^T L + shift I)^-1 x, lanes x columns.
  void solve(Lanes& x) const;
  /// Column `column` of the inverse, every lane: x is lanes x columns.
  void inverse_column(int column, Lanes& x) const;
  /// The diagonal entry of that column: lanes.
  void inverse_diagonal(int column, Eigen::VectorXd& own) const;

 private:
  void insert(int start, double* row);
  template <int kWidth, int kBorder>
  void insert_row(int start, double* row);
  template <int kWidth, int kBorder>
  void forward(Lanes& x, int from) const;
  template <int kWidth, int kBorder>
  void backward(Lanes& x) const;
  /// Puts a row's numbers where insert() takes them.
  void spread(const BandedRow& row, Lanes& numbers) const;
  [[nodiscard]] std::size_t place(int column) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(width_ + border_) *
           static_cast<std::size_t>(lanes_);
  }
  /// x <- R^-T x; nothing above column `from` in x.
  void forward_substitute(Lanes& x, int from) const;
  void back_substitute(Lanes& x) const;

  int width_ = 4, border_ = 0, columns_ = 0, lanes_ = 0;
  std::vector<double> r_;       // [column][1/diagonal, width - 1 superdiagonals, border][lane]
  std::vector<char> occupied_;  // columns whose row of R is not empty
};

}  // namespace limber::spacetime
