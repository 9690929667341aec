#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <memory>
#include <optional>

#include "engine/base/numerics/failed_pivot.h"

namespace limber::detail {

/// P A P^T = L L^T by CHOLMOD's supernodal module, the default of SparseCholesky. BLAS is pinned to
/// one thread so that results do not depend on the number of cores. The module is under the GPL
/// (NOTICE.md).
class SupernodalCholesky {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  /// Scratch memory of a solve, which grows as needed.
  class Workspace {
   public:
    Workspace();
    ~Workspace();
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;

   private:
    friend class SupernodalCholesky;
    struct State;
    std::unique_ptr<State> state_;
  };

  SupernodalCholesky();
  ~SupernodalCholesky();
  SupernodalCholesky(const SupernodalCholesky&) = delete;
  SupernodalCholesky& operator=(const SupernodalCholesky&) = delete;

  /// As of MultifrontalCholesky.
  /// @throws Error{kLimitExceeded} if the factor does not fit
  void analyse(const Matrix& a);
  [[nodiscard]] std::optional<FailedPivot> factor(const Matrix& a);
  void solve_in_place(double* b, Eigen::Index columns, Eigen::Index stride,
                      Workspace& workspace) const;
  [[nodiscard]] int size() const;
  [[nodiscard]] std::size_t factor_nonzeros() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace limber::detail
