#include "engine/beams/solver/stability.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "engine/base/numerics/dense.h"
#include "engine/base/random.h"

namespace limber::beams::detail {

namespace {

constexpr int kMaxSteps = 120;                 // Lanczos steps at most
constexpr int kLanczosStepsBetweenChecks = 5;  // of the residual
// Largest residual of an accepted direction, as a share of its quotient.
constexpr double kSharpEnough = 1e-2;
constexpr int kRounds = 4;            // factorizations at most, each with more noise added
constexpr double kExhausted = 1e-12;  // of a new direction: it is a combination of the old ones

/// B-orthonormal directions q, and B q beside them, so that B itself is not needed.
class KrylovSpace {
 public:
  KrylovSpace(const Eigen::SparseMatrix<double>& lower, const SparseCholesky& factor,
              Eigen::VectorXd start)
      : lower_(lower), factor_(factor), steps_(std::min<Eigen::Index>(start.size(), kMaxSteps)) {
    q_.resize(start.size(), steps_);
    bq_.resize(start.size(), steps_);
    diagonal_.resize(steps_);
    beside_.resize(steps_);
    const Eigen::VectorXd z = factor.solve(start);
    add(z, start, std::sqrt(z.dot(start)));
  }

  /// @returns whether there may be more to find
  bool step() {
    const Eigen::Index last = size_ - 1;
    Eigen::VectorXd r = lower_.selfadjointView<Eigen::Lower>() * q_.col(last);
    diagonal_[last] = q_.col(last).dot(r);
    Eigen::VectorXd z = factor_.solve(r);
    const double before = std::sqrt(std::abs(z.dot(r)));
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::VectorXd shares = q_.leftCols(size_).transpose() * r;
      r -= bq_.leftCols(size_) * shares;
      z -= q_.leftCols(size_) * shares;
    }
    const double squared = z.dot(r);
    beside_[last] = squared > 0 ? std::sqrt(squared) : 0;
    steps_done_ = static_cast<int>(size_);
    if (size_ == steps_ || !(beside_[last] > kExhausted * before)) return false;
    add(z, r, beside_[last]);
    return true;
  }

  [[nodiscard]] int steps_done() const { return steps_done_; }

  struct Ritz {
    CurvedDirection found;
    double residual = 0;
  };
  /// Lowest of all steps that were done.
  [[nodiscard]] Ritz lowest() const {
    const Eigen::Index n = steps_done_;
    const SymmetricEigen small(diagonal_.head(n), beside_.head(n - 1));
    const Eigen::VectorXd shares = small.eigenvectors().col(0);
    return {{small.eigenvalues()[0], q_.leftCols(n) * shares},
            std::abs(beside_[n - 1] * shares[n - 1])};
  }

 private:
  void add(const Eigen::VectorXd& z, const Eigen::VectorXd& r, double norm) {
    q_.col(size_) = z / norm;
    bq_.col(size_) = r / norm;
    ++size_;
  }

  const Eigen::SparseMatrix<double>& lower_;
  const SparseCholesky& factor_;
  const Eigen::Index steps_;
  Eigen::MatrixXd q_, bq_;
  Eigen::VectorXd diagonal_, beside_;
  Eigen::Index size_ = 0;
  int steps_done_ = 0;
};

}  // namespace

CurvedDirection lowest_quotient(const Eigen::SparseMatrix<double>& lower,
                                const SparseCholesky& factor, const Eigen::VectorXd& weights,
                                const JobContext& context) {
  Random random(20);
  Eigen::VectorXd start(weights.size());
  for (double& entry : start) entry = random.uniform() - 0.5;
  KrylovSpace space(lower, factor, start.cwiseProduct(weights.cwiseSqrt()));
  while (space.step()) {
    context.throw_if_cancelled();
    if (space.steps_done() % kLanczosStepsBetweenChecks != 0) continue;
    KrylovSpace::Ritz ritz = space.lowest();
    if (ritz.found.quotient < 0 && ritz.residual < kSharpEnough * -ritz.found.quotient)
      return std::move(ritz.found);
  }
  return space.lowest().found;
}

Inertia inertia_of(const Eigen::SparseMatrix<double>& lower, const Eigen::VectorXd& noise,
                   const JobContext& context) {
  Eigen::SparseMatrix<double> shifted = lower;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> ldlt;
  ldlt.analyzePattern(lower);
  Inertia result;
  // A pivot that is exactly zero ends it: numbers so even are not met twice.
  for (int round = 0; round < kRounds; ++round) {
    context.throw_if_cancelled();
    for (int i = 0; i < shifted.outerSize(); ++i)
      shifted.valuePtr()[shifted.outerIndexPtr()[i]] += noise[i];
    ldlt.factorize(shifted);
    if (ldlt.info() == Eigen::Success) break;
  }
  if (ldlt.info() != Eigen::Success) return result;
  const Eigen::VectorXd pivots = ldlt.vectorD();
  Eigen::Index lowest = 0;
  if (pivots.minCoeff(&lowest) >= 0) return result;
  result.negative = static_cast<int>((pivots.array() < 0).count());
  // L^T v = e: v^T A v is that pivot.
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(pivots.size(), lowest);
  result.direction = ldlt.permutationPinv() * Eigen::VectorXd(ldlt.matrixU().solve(unit));
  return result;
}

}  // namespace limber::beams::detail
