#include "engine/rods/equilibrium/length_system.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/engine/rods/linkage/state_charts.h"
#include "tests/support/dense.h"

namespace limber::rods {
namespace {

using namespace testing;

/// A linkage beside the same matrix written out.
struct LengthCase {
  explicit LengthCase(LinkageModel given, double stretch)
      : model(std::move(given)), state(model), matrix(model.chains()), system(model) {
    model.set_segment_lengths(stretch * model.segment_lengths());
    state = LinkageState(model);
    LinkageAssembly assembly(model);
    LinkageDerivatives derivatives(model);
    Eigen::VectorXd gradient(model.variables().size());
    (void)assembly.hessian(state, gradient, matrix);
    mixed = derivatives.by_lengths({state});
    const Eigen::Index n = gradient.size(), m = model.segment_lengths().size();
    whole.resize(n + m, n + m);
    for (Eigen::Index i = 0; i < n; ++i)
      whole.col(i).head(n) =
          derivatives.second({state}, {Eigen::VectorXd::Unit(n, i), {}}).unknowns;
    whole.topRightCorner(n, m) = mixed.unknowns;
    whole.bottomLeftCorner(m, n) = Eigen::MatrixXd(mixed.unknowns).transpose();
    whole.bottomRightCorner(m, m) = mixed.lengths;
  }
  LinkageModel model;
  LinkageState state;
  CondensedMatrix matrix;
  detail::LengthSystem system;
  LinkageDerivatives::ByLengths mixed;
  Eigen::MatrixXd whole;
};

/// Solves with a shift, a pinned unknown and a held length, and puts the answer into the matrix.
void check_against_dense(LengthCase& c) {
  constexpr double kShift = 0.3, kWeight = 0.7;
  const Eigen::Index n = c.model.variables().size(), m = c.model.segment_lengths().size();
  const std::vector<int> pinned{0, static_cast<int>(n) - 1};
  std::vector<char> held(static_cast<std::size_t>(m), 0);
  held[1] = 1;
  c.system.set_pinned(pinned);
  c.system.set_shift_weights(Eigen::VectorXd::Constant(n, 2));
  LinkageDerivatives::ByLengths free = c.mixed;
  free.unknowns.prune(
      [&](Eigen::Index row, Eigen::Index, double) { return row != pinned[0] && row != pinned[1]; });
  Eigen::MatrixXd whole = c.whole;
  whole.diagonal().head(n).array() += kShift * 2;
  whole.diagonal().tail(m).array() += kShift * kWeight;
  for (const Eigen::Index fixed : {Eigen::Index{pinned[0]}, Eigen::Index{pinned[1]}, n + 1}) {
    whole.row(fixed).setZero();
    whole.col(fixed).setZero();
    whole(fixed, fixed) = 1;
  }
  const bool positive = reference::symmetric_eigenvalues(whole)[0] > 0;
  EXPECT_EQ(c.system.factor(c.matrix, free, kShift, kWeight, held), positive);
  ASSERT_TRUE(positive);
  Random random(5);
  LinkageVector right{random_increment(n, 1, random), random_increment(m, 1, random)};
  for (const int unknown : pinned) right.unknowns[unknown] = 0;
  right.lengths[1] = 0;
  LinkageVector x = right;
  c.system.solve_in_place(x);
  Eigen::VectorXd stacked(n + m), wanted(n + m);
  stacked << x.unknowns, x.lengths;
  wanted << right.unknowns, right.lengths;
  EXPECT_LT((whole * stacked - wanted).norm(), 1e-9 * wanted.norm());
  EXPECT_EQ(x.lengths[1], 0);
}

TEST(LengthSystem, SolvesWhatTheMatrixWrittenOutSays) {
  LengthCase curved(curved_model(), 0.99);  // pulled: stable
  check_against_dense(curved);
  LengthCase mixed(mixed_model(), 0.99);  // free ends, lone rods, joints of every valence
  check_against_dense(mixed);
}

TEST(LengthSystem, DetectsIndefiniteMatrices) {
  // Pushed together by a third, rods buckle.
  LengthCase pushed(grid_model(3, 3, 1.0), 1.5);
  const std::vector<char> none(static_cast<std::size_t>(pushed.model.segment_lengths().size()), 0);
  EXPECT_LT(reference::symmetric_eigenvalues(pushed.whole)[0], 0);
  EXPECT_FALSE(pushed.system.factor(pushed.matrix, pushed.mixed, 0, 1, none));
  const double enough = 10 * pushed.whole.cwiseAbs().rowwise().sum().maxCoeff();
  EXPECT_TRUE(pushed.system.factor(pushed.matrix, pushed.mixed, enough, 1, none));
}

}  // namespace
}  // namespace limber::rods
