#include "engine/rods/solver/condensed_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/error.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/base/parallel.h"
#include "engine/rods/linkage/chains.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/solver/random_linkage.h"
#include "tests/support/dense.h"

namespace limber::rods {
namespace {

using reference::negative_eigenvalues;
using testing::fill_randomly;
using testing::known_linkages;
using testing::KnownLinkage;
using testing::linkage_file;

using Structure = std::shared_ptr<const ChainBatches>;

Structure chains(std::vector<Chain> list, int joints) {
  return std::make_shared<const ChainBatches>(std::move(list), joints);
}

/// Every kind of chain at its least and at other lengths, two components, a lone rod.
Structure mixed_chains() {
  return chains({{3, 0, 1},
                 {4, 1, 2},
                 {5, 2, 0},
                 {2, 0, -1},
                 {3, 1, -1},
                 {9, 2, -1},
                 {2, -1, 2},
                 {3, -1, 1},
                 {6, -1, 3},
                 {1, -1, -1},
                 {4, -1, -1},
                 {3, 3, 4},
                 {3, 4, 5},
                 {3, 5, 3},
                 {3, 4, 0},
                 {10, 1, 5},
                 {6, 6, 7}},
                8);
}

Structure load(const KnownLinkage& known, int edges) {
  const LinkageGraph graph =
      build_linkage_graph(scene::read_line_mesh_file(linkage_file(known.name)));
  return chains_of(graph, ReducedVariables(graph, edges));
}

Eigen::VectorXd random_values(Eigen::Index size, Random& random) {
  return Eigen::VectorXd::NullaryExpr(size, [&] { return random.normal(); });
}

/// |H x - b| / (|H| |x| + |b|)
double backward_error(const Eigen::SparseMatrix<double>& h, const Eigen::VectorXd& x,
                      const Eigen::VectorXd& b) {
  double norm = 0;
  for (int k = 0; k < h.nonZeros(); ++k) norm = std::max(norm, std::abs(h.valuePtr()[k]));
  return (h * x - b).norm() / (norm * x.norm() + b.norm());
}

TEST(CondensedMatrix, MultipliesAsItsSparseForm) {
  Random random(1);
  const Structure structure = mixed_chains();
  CondensedMatrix matrix(structure);
  fill_randomly(matrix, 0.3, random);
  const Eigen::SparseMatrix<double> sparse = matrix.to_sparse();
  EXPECT_LT((Eigen::MatrixXd(sparse) - Eigen::MatrixXd(sparse).transpose()).norm(), 1e-13);
  const Eigen::VectorXd x = random_values(structure->size(), random);
  Eigen::VectorXd y(x.size());
  matrix.multiply(x, y);
  EXPECT_LT((y - sparse * x).norm(), 1e-12 * y.norm());
}

TEST(CondensedSolver, AgreesWithDenseForEveryKindOfChain) {
  const Structure structure = mixed_chains();
  CondensedSolver solver(structure);
  CondensedMatrix matrix(structure);
  Random random(2);
  for (const double negative : {0.0, 0.0, 0.1, 0.5}) {
    fill_randomly(matrix, negative, random);
    const Eigen::MatrixXd dense = matrix.to_sparse();
    const PivotCount pivots = solver.factor(matrix);
    EXPECT_EQ(pivots.negative, negative_eigenvalues(dense));
    EXPECT_EQ(pivots.positive + pivots.negative, dense.rows());
    EXPECT_EQ(pivots.positive_definite(), negative == 0);
    EXPECT_EQ(solver.pivots(), pivots);
    Eigen::VectorXd b = random_values(dense.rows(), random);
    for (const bool loads_on_joints_alone : {false, true}) {
      if (loads_on_joints_alone) b.head(structure->joint_begin(0)).setZero();
      Eigen::VectorXd x = b;
      solver.solve_in_place(x);
      const Eigen::VectorXd expected = reference::solve_symmetric(dense, b);
      EXPECT_LT((x - expected).norm(), (negative == 0 ? 1e-9 : 1e-6) * expected.norm());
    }
  }
}

TEST(CondensedSolver, ShiftsByWeights) {
  const Structure structure = mixed_chains();
  CondensedSolver solver(structure);
  CondensedMatrix matrix(structure);
  Random random(3);
  fill_randomly(matrix, 0.3, random);
  Eigen::VectorXd weights = random_values(structure->size(), random).cwiseAbs();
  weights[5] = 0;
  const Eigen::VectorXd b = random_values(structure->size(), random);
  for (const bool own : {false, true}) {
    if (own) solver.set_shift_weights(weights);
    for (const double shift : {0.0, 0.7, 40.0}) {
      Eigen::MatrixXd dense = matrix.to_sparse();
      dense.diagonal() += shift * (own ? weights : Eigen::VectorXd::Ones(weights.size()));
      EXPECT_EQ(solver.factor(matrix, shift).negative, negative_eigenvalues(dense));
      Eigen::VectorXd x = b;
      solver.solve_in_place(x);
      EXPECT_LT((dense * x - b).norm(), 1e-8 * (1 + x.norm()));
    }
  }
  EXPECT_THROW(solver.set_shift_weights(Eigen::VectorXd::Ones(3)), Error);
  weights[7] = -1;
  EXPECT_THROW(solver.set_shift_weights(weights), Error);
}

TEST(CondensedSolver, PinnedUnknownsStay) {
  const Structure structure = mixed_chains();
  CondensedSolver solver(structure);
  CondensedMatrix matrix(structure);
  Random random(4);
  fill_randomly(matrix, 0, random);
  const Eigen::MatrixXd free = matrix.to_sparse();
  std::vector<int> pinned = {structure->joint_begin(0), structure->joint_begin(4) + 6};
  for (int k = 0; k < 9; ++k) pinned.push_back(structure->joint_begin(2) + k);
  for (std::size_t c = 0; c < structure->chains().size(); ++c) {
    if (c % 3 == 0) pinned.push_back(structure->chain_begin(static_cast<int>(c)));
    if (c % 4 == 1)
      pinned.push_back(structure->chain_begin(static_cast<int>(c)) +
                       structure->chain_size(static_cast<int>(c)) - 1);
  }
  Eigen::MatrixXd dense = free;
  for (const int i : pinned) {
    dense.row(i).setZero();
    dense.col(i).setZero();
    dense(i, i) = 1;
  }
  solver.set_pinned(pinned);
  const Eigen::VectorXd b = random_values(dense.rows(), random);
  EXPECT_TRUE(solver.factor(matrix).positive_definite());
  Eigen::VectorXd x = b;
  solver.solve_in_place(x);
  EXPECT_LT((x - reference::solve_symmetric(dense, b)).norm(), 1e-9 * x.norm());
  for (const int i : pinned) EXPECT_EQ(x[i], b[i]);
  // And back.
  solver.set_pinned({});
  (void)solver.factor(matrix);
  x = b;
  solver.solve_in_place(x);
  EXPECT_LT((free * x - b).norm(), 1e-9 * (1 + x.norm()));
  EXPECT_THROW(solver.set_pinned({structure->size()}), Error);
}

TEST(CondensedSolver, AgreesWithCholmodOnEveryKnownLinkage) {
  if (!std::filesystem::exists(linkage_file("hourglass"))) GTEST_SKIP() << "no data";
  Random random(5);
  for (const KnownLinkage& known : known_linkages()) {
    for (const int edges : {3, known.edges_per_segment}) {
      SCOPED_TRACE(known.name);
      const Structure structure = load(known, edges);
      CondensedMatrix matrix(structure);
      fill_randomly(matrix, 0, random);
      const Eigen::SparseMatrix<double> sparse = matrix.to_sparse();
      CondensedSolver solver(structure);
      EXPECT_TRUE(solver.factor(matrix).positive_definite());
      const Eigen::VectorXd b = random_values(structure->size(), random);
      Eigen::VectorXd x = b;
      solver.solve_in_place(x);
      EXPECT_LT(backward_error(sparse, x, b), 1e-13);
      const Eigen::VectorXd expected = SparseCholesky(sparse).solve(b);
      EXPECT_LT((x - expected).norm(), 1e-9 * expected.norm());
    }
  }
}

TEST(CondensedSolver, TellsTheInertiaOfEveryKnownLinkage) {
  if (!std::filesystem::exists(linkage_file("hourglass"))) GTEST_SKIP() << "no data";
  Random random(6);
  for (const KnownLinkage& known : known_linkages()) {
    SCOPED_TRACE(known.name);
    const Structure structure = load(known, known.edges_per_segment);
    CondensedMatrix matrix(structure);
    fill_randomly(matrix, 0.2, random);
    const Eigen::SparseMatrix<double> sparse = matrix.to_sparse();
    const reference::SparseLdlt expected(sparse);
    ASSERT_TRUE(expected.has_factor());
    CondensedSolver solver(structure);
    EXPECT_EQ(solver.factor(matrix).negative, (expected.pivots().array() < 0).count());
    const Eigen::VectorXd b = random_values(structure->size(), random);
    Eigen::VectorXd x = b;
    solver.solve_in_place(x);
    EXPECT_LT(backward_error(sparse, x, b), 1e-9);
  }
}

TEST(CondensedSolver, ResultsDoNotDependOnThreads) {
  std::vector<Chain> list;
  for (int j = 0; j + 1 < 60; ++j) {
    list.push_back({10, j, j + 1});
    if (j + 7 < 60) list.push_back({8, j + 7, j});
  }
  const Structure structure = chains(list, 60);
  const int before = thread_count();
  std::vector<Eigen::VectorXd> answers;
  for (const int threads : {1, 2, 3}) {
    set_thread_count(threads);
    Random random(7);
    CondensedMatrix matrix(structure);
    fill_randomly(matrix, 0, random);
    CondensedSolver solver(structure);
    (void)solver.factor(matrix, 0.25);
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(structure->size(), -1, 1);
    solver.solve_in_place(x);
    answers.push_back(x);
  }
  set_thread_count(before);
  EXPECT_EQ(answers[0], answers[1]);
  EXPECT_EQ(answers[0], answers[2]);
}

TEST(CondensedSolver, SingularChainsAreDetected) {
  const Structure structure = chains({{5, 0, 1}, {4, 0, -1}}, 2);
  CondensedMatrix matrix(structure);
  Random random(8);
  fill_randomly(matrix, 0, random);
  for (int row = 0; row < 23; ++row) {
    if (std::abs(row - 9) <= 10) matrix.entry(0, std::max(row, 9), std::min(row, 9)) = 0;
  }
  CondensedSolver solver(structure);
  EXPECT_EQ(solver.factor(matrix).vanishing, 1);
  EXPECT_EQ(solver.factor(matrix, 1).vanishing, 0);
  EXPECT_TRUE(solver.pivots().positive_definite());
}

}  // namespace
}  // namespace limber::rods
