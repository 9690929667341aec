#include "tests/support/literal_spacetime.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

#include "engine/base/error.h"
#include "engine/base/numerics/sparse_cholesky.h"

namespace limber::testing {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
using Triplet = Eigen::Triplet<double>;

namespace {

int pinned(spacetime::EndCondition end) { return static_cast<int>(end); }

/// Factors of stiff modes fade below 1e-308 over a long time line, and processors are slow with
/// what is left there. The baseline shall not pay for that.
class FlushedDenormals {
 public:
#ifdef __SSE2__
  FlushedDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040U); }
  ~FlushedDenormals() { _mm_setcsr(before_); }
  FlushedDenormals(const FlushedDenormals&) = delete;
  FlushedDenormals& operator=(const FlushedDenormals&) = delete;

 private:
  unsigned before_;
#endif
};

}  // namespace

class LiteralSpacetime::Impl {
 public:
  std::shared_ptr<const reduced::Kinematics> kinematics;
  spacetime::ModeDynamics dynamics;
  spacetime::Timeline timeline;
  std::vector<spacetime::PositionConstraint> constraints;
  spacetime::SolverOptions options;

  int modes = 0, frames = 0, first = 0, last = 0;  // free frames first .. last
  std::vector<int> columns;                        // distinct constrained frames
  std::vector<reduced::SiteQuery> queries;
  VectorXd weight, target;  // 3 per constraint; weight 0 on unwanted axes; unitless
  Sparse force_hessian;     // H_f of the free unknowns, lower triangle
  Sparse hessian;           // H_z, the pattern of H_f and of the constrained frames' blocks
  VectorXd force_values;    // values of H_f in that pattern
  bool analysed = false;
  SparseCholesky cholesky;
  MatrixXd columns_z, jacobian;
  Eigen::Matrix3Xd u;

  [[nodiscard]] Index unknown(int frame, int mode) const {
    return static_cast<Index>(frame - first) * modes + mode;
  }
  [[nodiscard]] bool is_free(int frame) const { return frame >= first && frame <= last; }

  void prepare() {
    modes = static_cast<int>(dynamics.stiffness.size());
    frames = timeline.frame_count;
    first = pinned(timeline.first);
    last = frames - 1 - pinned(timeline.last);
    std::map<int, int> column_of;
    for (const auto& constraint : constraints) column_of.emplace(constraint.frame, 0);
    for (auto& [frame, column] : column_of) {
      column = static_cast<int>(columns.size());
      columns.push_back(frame);
    }
    weight.setZero(3 * static_cast<Index>(constraints.size()));
    target.setZero(weight.size());
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      const auto& constraint = constraints[i];
      queries.push_back({constraint.site, column_of[constraint.frame]});
      for (int axis = 0; axis < 3; ++axis) {
        const Index row = 3 * static_cast<Index>(i) + axis;
        if ((constraint.axes >> axis & 1U) != 0) weight[row] = constraint.weight;
        target[row] = constraint.target[axis] / kinematics->length();
      }
    }
    assemble_force();
  }

  void assemble_force() {
    std::vector<Triplet> triplets;
    for (int k = 0; k < modes; ++k) {
      const double row[3] = {1, -2 - dynamics.damping[k] + dynamics.stiffness[k],
                             1 + dynamics.damping[k]};
      for (int i = 1; i + 1 < frames; ++i) {
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b <= a; ++b) {
            if (!is_free(i - 1 + a) || !is_free(i - 1 + b)) continue;
            triplets.emplace_back(unknown(i - 1 + a, k), unknown(i - 1 + b, k), row[a] * row[b]);
          }
        }
      }
    }
    const Index size = static_cast<Index>(last - first + 1) * modes;
    force_hessian.resize(size, size);
    force_hessian.setFromTriplets(triplets.begin(), triplets.end());
    for (const int frame : columns) {
      if (!is_free(frame)) continue;
      for (int k = 0; k < modes; ++k) {
        for (int l = 0; l <= k; ++l) triplets.emplace_back(unknown(frame, k), unknown(frame, l), 0);
      }
    }
    for (Index i = 0; i < size; ++i) triplets.emplace_back(i, i, 0);
    hessian.resize(size, size);
    hessian.setFromTriplets(triplets.begin(), triplets.end());
    force_values = Eigen::Map<const VectorXd>(hessian.valuePtr(), hessian.nonZeros());
  }

  /// Where (row, column) of the lower triangle is kept in `hessian`.
  [[nodiscard]] Index slot(Index row, Index column) const {
    const auto* begin = hessian.innerIndexPtr() + hessian.outerIndexPtr()[column];
    const auto* end = hessian.innerIndexPtr() + hessian.outerIndexPtr()[column + 1];
    return std::lower_bound(begin, end, row) - hessian.innerIndexPtr();
  }

  void evaluate(const MatrixXd& z, bool with_jacobian, VectorXd& residual) {
    columns_z.setZero(kinematics->coordinate_count(), static_cast<Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      columns_z.col(static_cast<Index>(c)).head(modes) = z.col(columns[c]);
    }
    kinematics->evaluate(columns, columns_z, queries, u, with_jacobian ? &jacobian : nullptr);
    residual = target - Eigen::Map<const VectorXd>(u.data(), u.size()) / kinematics->length();
    if (with_jacobian) jacobian /= kinematics->length();
  }

  [[nodiscard]] double force(const MatrixXd& z) const {
    double sum = 0;
    for (int i = 1; i + 1 < frames; ++i) {
      for (int k = 0; k < modes; ++k) {
        const double acceleration = z(k, i + 1) - 2 * z(k, i) + z(k, i - 1);
        const double velocity = z(k, i + 1) - z(k, i);
        const double value =
            acceleration + dynamics.damping[k] * velocity + dynamics.stiffness[k] * z(k, i);
        sum += value * value;
      }
    }
    return 0.5 * sum;
  }

  [[nodiscard]] double energy(const MatrixXd& z, const VectorXd& residual) const {
    return force(z) + 0.5 * residual.cwiseAbs2().dot(weight);
  }

  /// grad E, of the free unknowns.
  [[nodiscard]] VectorXd gradient(const VectorXd& free_z, const VectorXd& residual) const {
    VectorXd g = force_hessian.selfadjointView<Eigen::Lower>() * free_z;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      const int frame = constraints[i].frame;
      if (!is_free(frame)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const Index row = 3 * static_cast<Index>(i) + axis;
        g.segment(unknown(frame, 0), modes) -=
            weight[row] * residual[row] * jacobian.row(row).head(modes).transpose();
      }
    }
    return g;
  }

  void assemble() {
    Eigen::Map<VectorXd>(hessian.valuePtr(), hessian.nonZeros()) = force_values;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      const int frame = constraints[i].frame;
      if (!is_free(frame)) continue;
      const auto rows = jacobian.middleRows(3 * static_cast<Index>(i), 3).leftCols(modes);
      const MatrixXd block =
          rows.transpose() * weight.segment(3 * static_cast<Index>(i), 3).asDiagonal() * rows;
      for (int l = 0; l < modes; ++l) {
        const Index first_slot = slot(unknown(frame, l), unknown(frame, l));
        // The block's rows are consecutive in the column: unknowns of one frame are neighbours.
        for (int k = l; k < modes; ++k) hessian.valuePtr()[first_slot + k - l] += block(k, l);
      }
    }
  }

  struct State {
    MatrixXd z;
    VectorXd residual;
    double energy = 0;
  };

  [[nodiscard]] double rest_energy() {
    VectorXd residual;
    evaluate(MatrixXd::Zero(modes, frames), false, residual);
    return 0.5 * residual.cwiseAbs2().dot(weight);
  }

  /// Gauss-Newton at the present weights from `state`, whose residual and `jacobian` are those of
  /// its z. True: the gradient is below tolerance.
  bool iterate(State& state, int limit, double tolerance, LiteralResult& result,
               const std::function<void(double)>& accepted) {
    const double rest = rest_energy();
    VectorXd free_z = free_columns(state.z).reshaped();
    VectorXd trial_residual;
    MatrixXd trial = state.z;
    evaluate(state.z, true, state.residual);
    state.energy = energy(state.z, state.residual);
    for (int i = 0; i < limit; ++i, ++result.iterations) {
      const VectorXd g = gradient(free_z, state.residual);
      assemble();
      if (!analysed) cholesky.analyse(hessian);
      analysed = true;
      try {
        cholesky.refactor(hessian);
      } catch (const Error&) {
        return false;
      }
      const VectorXd step = -cholesky.solve(g);
      const double decrement2 = -g.dot(step);
      result.gradient = std::sqrt(std::max(0.0, decrement2) / (2 * (state.energy + 1e-6 * rest)));
      if (result.gradient <= tolerance) return true;
      double taken = 1;
      bool lower = false;
      for (int halving = 0; halving < 40 && !lower; ++halving, taken *= 0.5) {
        free_columns(trial).reshaped() = free_z + taken * step;
        evaluate(trial, halving == 0, trial_residual);
        const double value = energy(trial, trial_residual);
        lower = value < state.energy ||
                (decrement2 < 1e-12 * state.energy && value <= state.energy * (1 + 1e-14));
        if (!lower) continue;
        if (halving > 0) evaluate(trial, true, trial_residual);
        state.energy = value;
        free_z += taken * step;
        state.z = trial;
        state.residual = trial_residual;
      }
      if (!lower) return false;
      accepted(state.energy);
    }
    return false;
  }

  [[nodiscard]] Eigen::Block<MatrixXd, Eigen::Dynamic, Eigen::Dynamic, true> free_columns(
      MatrixXd& z) const {
    return z.middleCols(first, last - first + 1);
  }

  LiteralResult solve(const MatrixXd& start, double first_scale) {
    const auto begin = std::chrono::steady_clock::now();
    const FlushedDenormals flushed;
    LiteralResult result;
    State state{MatrixXd::Zero(modes, frames), {}, 0};
    free_columns(state.z) = start.middleCols(first, last - first + 1);
    const VectorXd full = weight;
    for (double scale = first_scale; scale < 0.99; scale *= 10) {
      weight = scale * full;
      iterate(state, 3, options.gradient_tolerance, result, [](double) {});
    }
    weight = full;
    result.converged = iterate(state, options.max_iterations, options.gradient_tolerance, result,
                               [&](double value) {
                                 const std::chrono::duration<double, std::milli> since =
                                     std::chrono::steady_clock::now() - begin;
                                 result.energies.push_back(value);
                                 result.milliseconds.push_back(since.count());
                               });
    result.z = state.z;
    result.force_energy = force(state.z);
    result.constraint_energy = 0.5 * state.residual.cwiseAbs2().dot(weight);
    result.total_energy = result.force_energy + result.constraint_energy;
    return result;
  }
};

LiteralSpacetime::LiteralSpacetime(std::shared_ptr<const reduced::Kinematics> kinematics,
                                   spacetime::ModeDynamics dynamics, spacetime::Timeline timeline,
                                   std::vector<spacetime::PositionConstraint> constraints,
                                   spacetime::SolverOptions options)
    : impl_(std::make_unique<Impl>()) {
  impl_->kinematics = std::move(kinematics);
  impl_->dynamics = std::move(dynamics);
  impl_->timeline = timeline;
  impl_->constraints = std::move(constraints);
  impl_->options = options;
  impl_->prepare();
}

LiteralSpacetime::~LiteralSpacetime() = default;

double LiteralSpacetime::force_energy(const MatrixXd& z) const { return impl_->force(z); }

double LiteralSpacetime::constraint_energy(const MatrixXd& z) const {
  VectorXd residual;
  impl_->evaluate(z, false, residual);
  return 0.5 * residual.cwiseAbs2().dot(impl_->weight);
}

MatrixXd LiteralSpacetime::gradient(const MatrixXd& z) const {
  MatrixXd result = MatrixXd::Zero(z.rows(), z.cols());
  MatrixXd free = z;
  VectorXd residual;
  impl_->evaluate(z, true, residual);
  impl_->free_columns(result).reshaped() =
      impl_->gradient(impl_->free_columns(free).reshaped(), residual);
  return result;
}

LiteralResult LiteralSpacetime::solve_cold() {
  return impl_->solve(MatrixXd::Zero(impl_->modes, impl_->frames), 1);
}

LiteralResult LiteralSpacetime::solve_continued() {
  return impl_->solve(MatrixXd::Zero(impl_->modes, impl_->frames), 1e-5);
}

LiteralResult LiteralSpacetime::solve_from(const MatrixXd& start) { return impl_->solve(start, 1); }

}  // namespace limber::testing
