#include "engine/base/numerics/supernodal_cholesky.h"

#ifdef LIMBER_SUPERNODAL

#include <cholmod.h>
#include <fmt/format.h>

#include <limits>
#include <mutex>

#include "engine/base/error.h"
#include "engine/base/numerics/metis_lock.h"

extern "C" void openblas_set_num_threads(int threads);
extern "C" void omp_set_max_active_levels(int levels);

namespace limber::detail {
namespace {

void pin_blas_to_one_thread() {
  static std::once_flag once;
  std::call_once(once, [] { openblas_set_num_threads(1); });
}

struct FactorCommon {
  FactorCommon() {
    pin_blas_to_one_thread();
    cholmod_start(&value);
    value.print = 0;
    value.supernodal = CHOLMOD_SUPERNODAL;
    value.final_ll = 1;
  }
  ~FactorCommon() { cholmod_finish(&value); }
  FactorCommon(const FactorCommon&) = delete;
  FactorCommon& operator=(const FactorCommon&) = delete;
  cholmod_common value{};
};

cholmod_dense dense_view(double* data, Eigen::Index rows, Eigen::Index columns,
                         Eigen::Index stride) {
  cholmod_dense view{};
  view.nrow = static_cast<std::size_t>(rows);
  view.ncol = static_cast<std::size_t>(columns);
  view.d = static_cast<std::size_t>(stride);
  view.nzmax = view.d * view.ncol;
  view.x = data;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  return view;
}

// CHOLMOD takes non-const pointers but does not write to its input matrix.
cholmod_sparse lower_view(const SupernodalCholesky::Matrix& a) {
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

}  // namespace

struct SupernodalCholesky::Workspace::State {
  FactorCommon common;
  cholmod_dense* y = nullptr;
  cholmod_dense* e = nullptr;
  ~State() {
    cholmod_free_dense(&y, &common.value);
    cholmod_free_dense(&e, &common.value);
  }
};

SupernodalCholesky::Workspace::Workspace() : state_(std::make_unique<State>()) {}
SupernodalCholesky::Workspace::~Workspace() = default;

struct SupernodalCholesky::State {
  FactorCommon common;
  cholmod_factor* factor = nullptr;
  ~State() { cholmod_free_factor(&factor, &common.value); }

  [[nodiscard]] int original_row(int permuted) const {
    return static_cast<const int*>(factor->Perm)[permuted];
  }

  [[noreturn]] void throw_failure() const {
    if (common.value.status == CHOLMOD_OUT_OF_MEMORY || common.value.status == CHOLMOD_TOO_LARGE) {
      throw Error(ErrorCode::kLimitExceeded, "matrix", "the Cholesky factor does not fit");
    }
    throw Error(ErrorCode::kInternal, "matrix",
                fmt::format("CHOLMOD failed with status {}", common.value.status));
  }

  [[nodiscard]] std::optional<FailedPivot> vanishing_pivot(const Eigen::VectorXd& diagonal) const {
    LIMBER_DEMAND(factor->is_super && factor->is_ll);
    const auto* super = static_cast<const int*>(factor->super);
    const auto* rows = static_cast<const int*>(factor->pi);
    const auto* values = static_cast<const int*>(factor->px);
    const auto* x = static_cast<const double*>(factor->x);
    for (std::size_t s = 0; s < factor->nsuper; ++s) {
      const std::ptrdiff_t height = rows[s + 1] - rows[s];
      for (int k = 0; k < super[s + 1] - super[s]; ++k) {
        const double root = x[values[s] + k * (height + 1)];
        const int row = original_row(super[s] + k);
        if (!(root * root > kRelativePivot * diagonal[row])) return FailedPivot{row, root * root};
      }
    }
    return std::nullopt;
  }
};

SupernodalCholesky::SupernodalCholesky() : state_(std::make_unique<State>()) {}
SupernodalCholesky::~SupernodalCholesky() = default;

void SupernodalCholesky::analyse(const Matrix& a) {
  cholmod_free_factor(&state_->factor, &state_->common.value);
  cholmod_sparse view = lower_view(a);
  {
    const std::lock_guard lock(metis_mutex());
    state_->factor = cholmod_analyze(&view, &state_->common.value);
  }
  if (state_->factor == nullptr) state_->throw_failure();
}

std::optional<FailedPivot> SupernodalCholesky::factor(const Matrix& a) {
  // CHOLMOD spreads copies over threads of OpenMP: waiting for these takes longer, most of all on a
  // busy machine.
  omp_set_max_active_levels(0);
  cholmod_sparse view = lower_view(a);
  cholmod_factorize(&view, state_->factor, &state_->common.value);
  if (state_->common.value.status == CHOLMOD_NOT_POSDEF) {
    return FailedPivot{state_->original_row(static_cast<int>(state_->factor->minor)),
                       std::numeric_limits<double>::quiet_NaN()};
  }
  if (state_->common.value.status != CHOLMOD_OK) state_->throw_failure();
  return state_->vanishing_pivot(a.diagonal());
}

void SupernodalCholesky::solve_in_place(double* b, Eigen::Index columns, Eigen::Index stride,
                                        Workspace& workspace) const {
  // x and b are the same memory: CHOLMOD permutes b into y first and writes x last.
  cholmod_dense view = dense_view(b, size(), columns, stride);
  cholmod_dense* x = &view;
  cholmod_dense right_hand_side = view;
  Workspace::State& scratch = *workspace.state_;
  const int done = cholmod_solve2(CHOLMOD_A, state_->factor, &right_hand_side, nullptr, &x, nullptr,
                                  &scratch.y, &scratch.e, &scratch.common.value);
  LIMBER_DEMAND(x == &view);
  if (done == 0) {
    throw Error(ErrorCode::kLimitExceeded, "", "not enough memory for a triangular solve");
  }
}

int SupernodalCholesky::size() const {
  return state_->factor == nullptr ? 0 : static_cast<int>(state_->factor->n);
}
std::size_t SupernodalCholesky::factor_nonzeros() const {
  return state_->factor == nullptr ? 0 : state_->factor->xsize;
}

}  // namespace limber::detail

#endif
