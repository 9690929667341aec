#include "engine/spacetime/exact_rows.h"

namespace limber::spacetime {
namespace {

constexpr int kMaxRounds = 100;
/// Rows of which a step takes off less than this depend on others.
constexpr double kLeastTaken = 1e-8;
/// Allowed ratio of the final residual to the initial one.
constexpr double kMostLeft = 0.5;

}  // namespace

bool meet_exact_rows(const ConstraintRows& rows, const RowProducts& products,
                     const Eigen::VectorXd& residual, double tolerance, const RowStep& solve,
                     Step& step) {
  const auto keep_exact = [&](Eigen::VectorXd& values) {
    for (int row = 0; row < rows.count(); ++row)
      if (!rows.exact(row)) values[row] = 0;
  };
  Eigen::VectorXd taken, m;
  Lanes d;
  products.multiply(step.d, taken);
  Eigen::VectorXd left = residual - taken;
  keep_exact(left);
  Eigen::VectorXd search = left;
  double square = left.squaredNorm();
  const double first = square;
  for (int round = 0; round < kMaxRounds && left.cwiseAbs().maxCoeff() > tolerance; ++round) {
    solve(search, d, m);
    products.multiply(d, taken);
    keep_exact(taken);
    const double bend = search.dot(taken);
    if (!(bend > kLeastTaken * search.squaredNorm())) break;
    const double alpha = square / bend;
    step.d += alpha * d;
    step.m += alpha * m;
    left -= alpha * taken;
    const double next = left.squaredNorm();
    search = left + next / square * search;
    square = next;
  }
  return square < kMostLeft * kMostLeft * first && step.m.allFinite();
}

}  // namespace limber::spacetime
