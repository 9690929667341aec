#include "engine/base/numerics/sparse_cholesky.h"

#include <cholmod.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/numerics/metis_lock.h"
#include "engine/base/parallel.h"

extern "C" void openblas_set_num_threads(int threads);
extern "C" void omp_set_max_active_levels(int levels);

namespace limber {
namespace {

// A pivot below this share of its diagonal entry is rounding noise: the matrix is singular in
// double precision.
constexpr double kRelativePivot = 4 * std::numeric_limits<double>::epsilon();

// Columns solved together: enough for the triangular BLAS kernels, small enough to share work
// between threads.
constexpr Eigen::Index kColumnsPerBlock = 16;

void pin_blas_to_one_thread() {
  static std::once_flag once;
  std::call_once(once, [] { openblas_set_num_threads(1); });
}

struct Common {
  Common() {
    pin_blas_to_one_thread();
    cholmod_start(&value);
    value.print = 0;
    value.supernodal = CHOLMOD_SUPERNODAL;
    value.final_ll = 1;
  }
  ~Common() { cholmod_finish(&value); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;
  cholmod_common value{};
};

cholmod_dense dense_view(double* data, Eigen::Index rows, Eigen::Index columns) {
  cholmod_dense view{};
  view.nrow = static_cast<std::size_t>(rows);
  view.ncol = static_cast<std::size_t>(columns);
  view.nzmax = view.nrow * view.ncol;
  view.d = view.nrow;
  view.x = data;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  return view;
}

// CHOLMOD takes non-const pointers but does not write to its input matrix.
cholmod_sparse lower_view(const SparseCholesky::Matrix& a) {
  cholmod_sparse view{};
  view.nrow = static_cast<std::size_t>(a.rows());
  view.ncol = static_cast<std::size_t>(a.cols());
  view.nzmax = static_cast<std::size_t>(a.nonZeros());
  view.p = const_cast<int*>(a.outerIndexPtr());
  view.i = const_cast<int*>(a.innerIndexPtr());
  view.x = const_cast<double*>(a.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

void check_input(const SparseCholesky::Matrix& a) {
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

[[noreturn]] void throw_not_positive(int row, double pivot, double diagonal) {
  throw Error(ErrorCode::kNumerical, fmt::format("matrix[{}]", row),
              fmt::format("the matrix is not positive definite: the pivot of row {} is {:.3g} "
                          "where the diagonal is {:.3g}",
                          row, pivot, diagonal));
}

}  // namespace

struct SparseCholesky::Workspace::State {
  Common common;
  cholmod_dense* y = nullptr;
  cholmod_dense* e = nullptr;
  ~State() {
    cholmod_free_dense(&y, &common.value);
    cholmod_free_dense(&e, &common.value);
  }
};

SparseCholesky::Workspace::Workspace() : state_(std::make_unique<State>()) {}
SparseCholesky::Workspace::~Workspace() = default;
SparseCholesky::Workspace::Workspace(Workspace&&) noexcept = default;
SparseCholesky::Workspace& SparseCholesky::Workspace::operator=(Workspace&&) noexcept = default;

class SparseCholesky::Impl {
 public:
  ~Impl() { cholmod_free_factor(&factor_, &common_.value); }

  void analyse(const Matrix& a) {
    check_input(a);
    cholmod_free_factor(&factor_, &common_.value);
    factored_ = false;
    cholmod_sparse view = lower_view(a);
    {
      const std::lock_guard lock(detail::metis_mutex());
      factor_ = cholmod_analyze(&view, &common_.value);
    }
    if (factor_ == nullptr) throw_failure();
    pattern_ = pattern_of(a);
  }

  void factor_values(const Matrix& a) {
    factored_ = false;
    // CHOLMOD spreads copies over threads of OpenMP: waiting for these takes longer, most of all on
    // a busy machine.
    omp_set_max_active_levels(0);
    cholmod_sparse view = lower_view(a);
    cholmod_factorize(&view, factor_, &common_.value);
    const Eigen::VectorXd diagonal = a.diagonal();
    if (common_.value.status == CHOLMOD_NOT_POSDEF) {
      const int row = original_row(static_cast<int>(factor_->minor));
      throw_not_positive(row, std::numeric_limits<double>::quiet_NaN(), diagonal[row]);
    }
    if (common_.value.status != CHOLMOD_OK) throw_failure();
    check_pivots(diagonal);
    factored_ = true;
  }

  void refactor(const Matrix& a) {
    if (factor_ == nullptr) {
      throw Error(ErrorCode::kFailedPrecondition, "", "refactor needs a factor to start from");
    }
    check_input(a);
    if (static_cast<std::size_t>(a.cols()) != factor_->n || pattern_of(a) != pattern_) {
      throw Error(ErrorCode::kInvalidArgument, "matrix",
                  "refactor needs the pattern of the factored matrix");
    }
    factor_values(a);
  }

  void solve_contiguous(double* b, Eigen::Index columns, Workspace::State& workspace) const {
    // x and b are the same memory: CHOLMOD permutes b into y first and writes x last.
    cholmod_dense view = dense_view(b, size(), columns);
    cholmod_dense* x = &view;
    cholmod_dense right_hand_side = view;
    const int done = cholmod_solve2(CHOLMOD_A, factor_, &right_hand_side, nullptr, &x, nullptr,
                                    &workspace.y, &workspace.e, &workspace.common.value);
    LIMBER_DEMAND(x == &view);
    if (done == 0) {
      throw Error(ErrorCode::kLimitExceeded, "", "not enough memory for a triangular solve");
    }
  }

  void solve_block(Eigen::Ref<Eigen::MatrixXd> b, Workspace::State& workspace) const {
    LIMBER_DEMAND(factored_);
    LIMBER_DEMAND(b.rows() == size());
    if (b.cols() == 0) return;
    if (b.cols() == 1 || b.outerStride() == b.rows()) {
      solve_contiguous(b.data(), b.cols(), workspace);
      return;
    }
    for (Eigen::Index column = 0; column < b.cols(); ++column) {
      solve_contiguous(b.col(column).data(), 1, workspace);
    }
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
  int size() const { return factor_ == nullptr ? 0 : static_cast<int>(factor_->n); }
  std::size_t nonzeros() const { return factor_ == nullptr ? 0 : factor_->xsize; }

 private:
  int original_row(int permuted) const { return static_cast<const int*>(factor_->Perm)[permuted]; }

  [[noreturn]] void throw_failure() {
    if (common_.value.status == CHOLMOD_OUT_OF_MEMORY ||
        common_.value.status == CHOLMOD_TOO_LARGE) {
      throw Error(ErrorCode::kLimitExceeded, "matrix", "the Cholesky factor does not fit");
    }
    throw Error(ErrorCode::kInternal, "matrix",
                fmt::format("CHOLMOD failed with status {}", common_.value.status));
  }

  void check_pivots(const Eigen::VectorXd& diagonal) const {
    LIMBER_DEMAND(factor_->is_super && factor_->is_ll);
    const auto* super = static_cast<const int*>(factor_->super);
    const auto* rows = static_cast<const int*>(factor_->pi);
    const auto* values = static_cast<const int*>(factor_->px);
    const auto* x = static_cast<const double*>(factor_->x);
    for (std::size_t s = 0; s < factor_->nsuper; ++s) {
      const std::ptrdiff_t height = rows[s + 1] - rows[s];
      for (int k = 0; k < super[s + 1] - super[s]; ++k) {
        const double root = x[values[s] + k * (height + 1)];
        const int row = original_row(super[s] + k);
        if (!(root * root > kRelativePivot * diagonal[row])) {
          throw_not_positive(row, root * root, diagonal[row]);
        }
      }
    }
  }

  Common common_;
  cholmod_factor* factor_ = nullptr;
  std::string pattern_;
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
