#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <optional>
#include <vector>

#include "engine/base/numerics/failed_pivot.h"

namespace limber::detail {

/// P A P^T = L L^T of a symmetric positive definite sparse matrix, multifrontal, on Eigen's dense
/// kernels: what SparseCholesky runs on in a build without CHOLMOD's supernodal module
/// (LIMBER_SUPERNODAL=OFF). One thread factors; solves are const.
class MultifrontalCholesky {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  /// Scratch memory of a solve, which grows as needed.
  struct Workspace {
    Eigen::MatrixXd permuted;
    Eigen::MatrixXd rows;
  };

  /// Orders and lays out; only entries on and below the diagonal count. The values are not read.
  /// @param a  square, compressed, row indices ascending in each column
  void analyse(const Matrix& a);

  /// @param a  of the analysed pattern
  /// @returns nothing, or the first pivot that failed: then there is no factor
  [[nodiscard]] std::optional<FailedPivot> factor(const Matrix& a);

  /// b <- A^-1 b, size() x columns with the given outer stride. Needs a factor.
  void solve_in_place(double* b, Eigen::Index columns, Eigen::Index stride,
                      Workspace& workspace) const;

  [[nodiscard]] int size() const { return static_cast<int>(order_.size()); }
  /// Of L, explicit zeros included.
  [[nodiscard]] std::size_t factor_nonzeros() const { return panels_.size(); }

 private:
  /// Columns that are eliminated together and the rows that they couple. Numbers are places in the
  /// order of elimination.
  struct Front {
    int first = 0;  // column
    int columns = 0;
    std::vector<int> rows;    // below the columns, ascending
    std::vector<int> places;  // of each row in the parent: its columns first, then its rows
    std::vector<int> children;
    std::size_t panel = 0;      // in panels_: (columns + rows) x columns
    std::size_t remainder = 0;  // in remainders_: rows x rows, from when it is left over
    std::size_t work = 0;       // in remainders_: where it is built, above those of its children

    [[nodiscard]] Eigen::Index height() const {
      return columns + static_cast<Eigen::Index>(rows.size());
    }
  };

  void lay_out_remainders();
  void place_values(const Matrix& a);
  void add_child(const Front& child, const Front& front);
  [[nodiscard]] std::optional<FailedPivot> eliminate(const Front& front);

  std::vector<int> order_;            // row of A that is eliminated as k-th
  std::vector<Front> fronts_;         // children before parents
  std::vector<std::size_t> targets_;  // in panels_, of each entry of A; npos above the diagonal
  std::vector<double> panels_;
  std::vector<double> remainders_;  // a stack
  Eigen::VectorXd diagonal_;        // in the order of elimination, of the matrix being factored
};

}  // namespace limber::detail
