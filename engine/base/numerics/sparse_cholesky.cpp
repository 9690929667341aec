#include "engine/base/numerics/sparse_cholesky.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/parallel.h"
#ifdef LIMBER_SUPERNODAL
#include "engine/base/numerics/supernodal_cholesky.h"
#else
#include "engine/base/numerics/multifrontal_cholesky.h"
#endif

namespace limber {
namespace {

#ifdef LIMBER_SUPERNODAL
using Factor = detail::SupernodalCholesky;
constexpr CholeskyLibrary kLibrary = CholeskyLibrary::kCholmodSupernodal;
#else
using Factor = detail::MultifrontalCholesky;
constexpr CholeskyLibrary kLibrary = CholeskyLibrary::kOwnMultifrontal;
#endif

// Columns solved together: enough for the triangular BLAS kernels, small enough to share work
// between threads.
constexpr Eigen::Index kColumnsPerBlock = 16;

void check_symmetric_matrix(const SparseCholesky::Matrix& a) {
  if (a.rows() != a.cols() || a.rows() == 0) {
    throw Error(ErrorCode::kInvalidArgument, "matrix",
                fmt::format("a square matrix is needed, this one is {} x {}", a.rows(), a.cols()));
  }
  if (!a.isCompressed()) {
    throw Error(ErrorCode::kInvalidArgument, "matrix", "the sparse matrix must be compressed");
  }
  for (int column = 0; column < a.cols(); ++column) {
    for (SparseCholesky::Matrix::InnerIterator entry(a, column); entry; ++entry) {
      if (!std::isfinite(entry.value())) {
        throw Error(ErrorCode::kInvalidArgument, "matrix",
                    fmt::format("entry ({}, {}) is {}", entry.row(), entry.col(), entry.value()));
      }
    }
  }
}

std::string pattern_of(const SparseCholesky::Matrix& a) {
  ContentHash hash;
  hash.add_array(a.outerIndexPtr(), static_cast<std::size_t>(a.cols()) + 1);
  hash.add_array(a.innerIndexPtr(), static_cast<std::size_t>(a.nonZeros()));
  return hash.hex();
}

[[noreturn]] void throw_not_positive(const detail::FailedPivot& pivot,
                                     const Eigen::VectorXd& diagonal) {
  throw Error(ErrorCode::kNumerical, fmt::format("matrix[{}]", pivot.row),
              fmt::format("the matrix is not positive definite: the pivot of row {} is {:.3g} "
                          "where the diagonal is {:.3g}",
                          pivot.row, pivot.value, diagonal[pivot.row]));
}

}  // namespace

CholeskyLibrary cholesky_library() noexcept { return kLibrary; }

struct SparseCholesky::Workspace::State {
  Factor::Workspace scratch;
};

SparseCholesky::Workspace::Workspace() : state_(std::make_unique<State>()) {}
SparseCholesky::Workspace::~Workspace() = default;
SparseCholesky::Workspace::Workspace(Workspace&&) noexcept = default;
SparseCholesky::Workspace& SparseCholesky::Workspace::operator=(Workspace&&) noexcept = default;

class SparseCholesky::Impl {
 public:
  void analyse(const Matrix& a) {
    check_symmetric_matrix(a);
    factored_ = false;
    pattern_.clear();
    factor_.analyse(a);
    pattern_ = pattern_of(a);
  }

  void factor_values(const Matrix& a) {
    factored_ = false;
    if (const auto failed = factor_.factor(a)) throw_not_positive(*failed, a.diagonal());
    factored_ = true;
  }

  void refactor(const Matrix& a) {
    if (pattern_.empty()) {
      throw Error(ErrorCode::kFailedPrecondition, "", "refactor needs a factor to start from");
    }
    check_symmetric_matrix(a);
    if (a.cols() != size() || pattern_of(a) != pattern_) {
      throw Error(ErrorCode::kInvalidArgument, "matrix",
                  "refactor needs the pattern of the factored matrix");
    }
    factor_values(a);
  }

  void solve_block(Eigen::Ref<Eigen::MatrixXd> b, Workspace::State& workspace) const {
    LIMBER_DEMAND(factored_);
    LIMBER_DEMAND(b.rows() == size());
    if (b.cols() == 0) return;
    // CHOLMOD solves blocks without gaps only.
    if (b.cols() == 1 || b.outerStride() == b.rows()) {
      factor_.solve_in_place(b.data(), b.cols(), b.rows(), workspace.scratch);
      return;
    }
    for (Eigen::Index column = 0; column < b.cols(); ++column)
      factor_.solve_in_place(b.col(column).data(), 1, b.rows(), workspace.scratch);
  }

  std::unique_ptr<Workspace> borrow() const {
    const std::lock_guard lock(pool_mutex_);
    if (pool_.empty()) return std::make_unique<Workspace>();
    auto workspace = std::move(pool_.back());
    pool_.pop_back();
    return workspace;
  }
  void give_back(std::unique_ptr<Workspace> workspace) const {
    const std::lock_guard lock(pool_mutex_);
    pool_.push_back(std::move(workspace));
  }

  bool factored() const { return factored_; }
  int size() const { return factor_.size(); }
  std::size_t nonzeros() const { return factor_.factor_nonzeros(); }

 private:
  Factor factor_;
  std::string pattern_;  // empty before the first analysis
  bool factored_ = false;
  mutable std::mutex pool_mutex_;
  mutable std::vector<std::unique_ptr<Workspace>> pool_;
};

SparseCholesky::SparseCholesky() : impl_(std::make_unique<Impl>()) {}
SparseCholesky::SparseCholesky(const Matrix& a) : SparseCholesky() { factor(a); }
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

void SparseCholesky::factor(const Matrix& a) {
  impl_->analyse(a);
  impl_->factor_values(a);
}
void SparseCholesky::analyse(const Matrix& a) { impl_->analyse(a); }
void SparseCholesky::refactor(const Matrix& a) { impl_->refactor(a); }
bool SparseCholesky::factored() const noexcept { return impl_->factored(); }
int SparseCholesky::size() const noexcept { return impl_->size(); }
std::size_t SparseCholesky::factor_nonzeros() const noexcept { return impl_->nonzeros(); }

void SparseCholesky::solve_in_place(Eigen::Ref<Eigen::MatrixXd> b, Workspace& workspace) const {
  impl_->solve_block(b, *workspace.state_);
}

void SparseCholesky::solve_in_place(Eigen::Ref<Eigen::MatrixXd> b) const {
  parallel_for(b.cols(), kColumnsPerBlock, [&](std::int64_t begin, std::int64_t end) {
    auto workspace = impl_->borrow();
    impl_->solve_block(b.middleCols(begin, end - begin), *workspace->state_);
    impl_->give_back(std::move(workspace));
  });
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::Ref<const Eigen::MatrixXd>& b) const {
  Eigen::MatrixXd x = b;
  solve_in_place(x);
  return x;
}

}  // namespace limber
