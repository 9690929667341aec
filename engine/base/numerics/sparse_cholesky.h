#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <memory>

namespace limber {

enum class CholeskyLibrary {
  kCholmodSupernodal,  // under the GPL
  kOwnMultifrontal,
};

/// What this build factors with.
[[nodiscard]] CholeskyLibrary cholesky_library() noexcept;

/// P A P^T = L L^T of a symmetric positive definite sparse matrix: by CHOLMOD's supernodal module,
/// or by our own multifrontal one in builds without it (LIMBER_SUPERNODAL=OFF, see NOTICE.md).
/// Results do not depend on the number of cores.
///
/// `factor`, `analyse` and `refactor` need exclusive access; solves are const and may run
/// concurrently from several threads.
class SparseCholesky {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  /// Scratch memory of solves, reused between calls. One per thread; fits any factor and any number
  /// of columns.
  class Workspace {
   public:
    Workspace();
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

   private:
    friend class SparseCholesky;
    struct State;
    std::unique_ptr<State> state_;
  };

  SparseCholesky();
  /// Same as factor(a).
  explicit SparseCholesky(const Matrix& a);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// Orders, analyses and factors. Only entries on and below the diagonal are read, so that a full
  /// symmetric matrix and its lower triangle are the same input.
  /// @throws Error{kInvalidArgument} not square, not compressed or not finite; Error{kNumerical}
  /// not positive definite
  ///   (names the row of the failing pivot); Error{kLimitExceeded} if the factor does not fit
  void factor(const Matrix& a);

  /// Orders and analyses only, without values: the first half of factor(), for callers that want to
  /// stop or report in between. refactor() is the second half.
  /// @throws Error{kInvalidArgument}, Error{kLimitExceeded} as factor
  void analyse(const Matrix& a);

  /// New values on the pattern of the last factor() or analyse(): the ordering and the symbolic
  /// analysis are kept.
  /// @throws as factor, and Error{kInvalidArgument} for another pattern
  void refactor(const Matrix& a);

  [[nodiscard]] bool factored() const noexcept;
  [[nodiscard]] int size() const noexcept;  // n, 0 before the first factor
  [[nodiscard]] std::size_t factor_nonzeros()
      const noexcept;  // of L, explicit zeros of supernodes included

  /// b <- A^-1 b for an n x k block with unit inner stride (a vector is a block of one column).
  /// Many columns are solved in parallel blocks whose size does not depend on the number of
  /// threads.
  void solve_in_place(Eigen::Ref<Eigen::MatrixXd> b) const;

  /// Same on the calling thread only, without allocation once `workspace` has grown.
  void solve_in_place(Eigen::Ref<Eigen::MatrixXd> b, Workspace& workspace) const;

  /// A^-1 b as a new matrix.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& b) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber
