#include "engine/bodies/modal_analysis.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/bodies/rigid_modes.h"
#include "tests/engine/bodies/box_mesh.h"
#include "tests/engine/bodies/modal_checks.h"
#include "tests/support/dense.h"

namespace limber::bodies {
namespace {

using testing::box_body;
using testing::box_mesh;
using testing::expect_orthonormal;
using testing::Hold;
using testing::jitter;
using testing::modes_of;
using testing::worst_relative_residual;

double first_frequency(int cells_across) {
  // A cantilever of 1 x 1 x 10; nu = 0, so that the one-dimensional theory has no Poisson terms.
  const Material material{1e6, 0, 1000};
  const ElasticBody body = box_body({10 * cells_across, cells_across, cells_across}, {10, 1, 1},
                                    Hold::kLeftFace, material);
  return std::sqrt(modes_of(body, 2).eigenvalues[0]);
}

TEST(ModalAnalysis, CantileverConvergesToBeamTheory) {
  const double euler = 1.8751040687 * 1.8751040687 * std::sqrt(1e6 / 12 / 1000) / 100;
  const double f2 = first_frequency(2), f4 = first_frequency(4), f6 = first_frequency(6);
  // Linear tets are too stiff in bending; the error falls with the square of their size.
  EXPECT_GT(f2, f4);
  EXPECT_GT(f4, f6);
  const double limit = f6 + (f6 - f4) * 16 / (36 - 16);
  EXPECT_NEAR((f2 - limit) / (f4 - limit), 4, 0.6);
  // Shear and rotary inertia, which beam theory leaves out, cost about 1 % at this slenderness.
  EXPECT_LT(limit, euler);
  EXPECT_GT(limit, 0.98 * euler);
}

TEST(ModalAnalysis, FreeBarHasItsLongitudinalFrequency) {
  const Material material{1e6, 0, 1000};
  const ElasticBody body = box_body({16, 2, 2}, {4, 0.5, 0.5}, Hold::kFree, material);
  const ModalBasis basis = modes_of(body, 20);
  const double expected = std::pow(M_PI / 4, 2) * material.youngs_modulus / material.density;
  double nearest = 1e9;
  for (int k = 6; k < basis.modes.cols(); ++k) {
    const auto mode = basis.modes.col(k).reshaped(3, body.mesh.node_count());
    if (mode.row(0).squaredNorm() < 0.99 * mode.squaredNorm()) continue;
    nearest = std::min(nearest, std::abs(basis.eigenvalues[k] / expected - 1));
  }
  EXPECT_LT(nearest, 0.005);  // (k h)^2 / 12 = 0.0032 from the consistent mass
}

TEST(ModalAnalysis, AgreesWithADenseSolver) {
  ElasticBody body = box_body({5, 4, 4}, {1.5, 1, 1.2}, Hold::kLeftFace, {1e5, 0.4, 700});
  body.mesh = jitter(body.mesh, 0.05);
  const Eigen::MatrixXd stiffness = testing::free_stiffness(body);
  const Eigen::MatrixXd mass = testing::free_mass(body);
  ASSERT_GT(stiffness.rows(), 300) << "must not take the dense path itself";
  const Eigen::VectorXd expected = reference::generalized_eigenvalues(stiffness, mass);
  const ModalBasis basis = modes_of(body, 40);
  EXPECT_EQ(basis.rigid_count, 0);
  for (int k = 0; k < 40; ++k) {
    EXPECT_NEAR(basis.eigenvalues[k], expected[k], 1e-9 * expected[k]) << k;
  }
  EXPECT_LT(worst_relative_residual(body, basis), 1e-8);
  expect_orthonormal(body, basis);
}

TEST(ModalAnalysis, FreeBodyHasSixExactRigidModes) {
  ElasticBody body = box_body({6, 4, 3}, {2, 1, 0.7}, Hold::kFree);
  body.mesh = jitter(body.mesh, 0.03);
  const ModalBasis basis = modes_of(body, 15);
  ASSERT_EQ(basis.rigid_count, 6);
  ASSERT_EQ(basis.modes.cols(), 21);
  EXPECT_EQ(basis.eigenvalues.head(6), Eigen::VectorXd::Zero(6));
  EXPECT_EQ(basis.modes.leftCols(6), rigid_modes(body.mesh).modes);
  EXPECT_GT(basis.eigenvalues[6], 0);
  EXPECT_EQ(basis.mechanism_count, 0);
  EXPECT_LT(worst_relative_residual(body, basis), 1e-8);
  expect_orthonormal(body, basis);

  const Eigen::MatrixXd stiffness = testing::free_stiffness(body);
  const Eigen::VectorXd expected =
      reference::generalized_eigenvalues(stiffness, testing::free_mass(body));
  for (int k = 6; k < 21; ++k) {
    EXPECT_NEAR(basis.eigenvalues[k], expected[k], 1e-9 * expected[k]) << k;
  }
}

TEST(ModalAnalysis, FindsEveryCopyOfMultipleEigenvalues) {
  // Three equal bodies in one mesh: every eigenvalue is threefold. Lanczos alone may skip copies.
  const ElasticBody one = box_body({6, 3, 3}, {2, 1, 1}, Hold::kLeftFace);
  const int n = one.mesh.node_count(), m = one.mesh.tet_count();
  ElasticBody three = one;
  three.mesh.nodes.resize(3, 3 * n);
  three.mesh.tets.resize(4, 3 * m);
  three.mesh.tet_material.assign(3 * m, 0);
  three.fixed_nodes.clear();
  for (int copy = 0; copy < 3; ++copy) {
    three.mesh.nodes.middleCols(copy * n, n) =
        one.mesh.nodes.colwise() + Eigen::Vector3d(0, 4.0 * copy, 0);
    three.mesh.tets.middleCols(copy * m, m) = one.mesh.tets.array() + copy * n;
    for (const int node : one.fixed_nodes) three.fixed_nodes.push_back(copy * n + node);
  }
  const ModalBasis single = modes_of(one, 10);
  const ModalBasis triple = modes_of(three, 30);
  for (int k = 0; k < 30; ++k) {
    EXPECT_NEAR(triple.eigenvalues[k], single.eigenvalues[k / 3], 1e-9 * single.eigenvalues[k / 3]);
  }
  expect_orthonormal(three, triple);
}

TEST(ModalAnalysis, RerunsAndThreadCountsGiveTheSameBits) {
  const ElasticBody body = box_body({8, 4, 4}, {2, 1, 1}, Hold::kFree);
  const int threads = thread_count();
  set_thread_count(1);
  const ModalBasis alone = modes_of(body, 20);
  set_thread_count(4);
  const ModalBasis together = modes_of(body, 20);
  set_thread_count(threads);
  const ModalBasis again = modes_of(body, 20);
  EXPECT_EQ(alone.modes, together.modes);
  EXPECT_EQ(alone.eigenvalues, together.eigenvalues);
  EXPECT_EQ(alone.modes, again.modes);
}

TEST(ModalAnalysis, SignsAreFixed) {
  const ModalBasis basis = modes_of(box_body({8, 4, 4}, {2, 1, 1}, Hold::kLeftFace), 12);
  for (int k = 0; k < 12; ++k) {
    EXPECT_GT(basis.modes.col(k).maxCoeff(), (1 - 1e-5) * -basis.modes.col(k).minCoeff());
  }
}

TEST(ModalAnalysis, SmallestBodiesGiveAllTheirModes) {
  const ElasticBody tet{[] {
                          TetMesh mesh = box_mesh({1, 1, 1}, {1, 1, 1});
                          mesh.tets = TetNodes(mesh.tets.leftCols(1));
                          mesh.nodes = NodePositions(mesh.nodes(Eigen::all, mesh.tets.col(0)));
                          mesh.tets.col(0) = Eigen::Vector4i(0, 1, 2, 3);
                          mesh.tet_material = {0};
                          return mesh;
                        }(),
                        {}};
  const ModalBasis all = modes_of(tet, 6);
  EXPECT_EQ(all.modes.cols(), 12);
  EXPECT_LT(worst_relative_residual(tet, all), 1e-10);
  expect_orthonormal(tet, all);
  EXPECT_THROW((void)modes_of(tet, 7), Error);
  ElasticBody held = tet;
  held.fixed_nodes = {0, 1, 2};
  EXPECT_EQ(modes_of(held, 3).modes.cols(), 3);
  EXPECT_THROW((void)modes_of(held, 4), Error);
  held.fixed_nodes = {0, 1, 2, 3};
  EXPECT_THROW((void)modes_of(held, 1), Error);
}

TEST(ModalAnalysis, ManyOfTheModesOfABody) {
  const ElasticBody body = box_body({5, 4, 4}, {1.5, 1, 1.2}, Hold::kLeftFace);
  const ModalBasis few = modes_of(body, 10);
  const ModalBasis most = modes_of(body, 370);  // of 375
  EXPECT_LT((few.eigenvalues - most.eigenvalues.head(10)).norm(), 1e-9 * few.eigenvalues.norm());
  expect_orthonormal(body, most);
}

TEST(ModalAnalysis, CancellationAndProgress) {
  const ElasticBody body = box_body({8, 4, 4}, {2, 1, 1}, Hold::kLeftFace);
  JobContext job;
  std::vector<double> fractions;
  job.progress = [&](const std::string& stage, double fraction) {
    EXPECT_EQ(stage, "modes");
    fractions.push_back(fraction);
    if (fraction > 0.3) job.cancellation.request();
  };
  try {
    (void)modal_analysis(body, {}, job);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_LT(fractions.back(), 0.5);
}

/// Every call of progress is a place to stop at; between two of them there is one uninterruptible
/// piece at most: an analysis, a factor, a solve.
TEST(ModalAnalysis, StopsAtTheNextReport) {
  const ElasticBody body = box_body({8, 4, 4}, {2, 1, 1}, Hold::kLeftFace);
  std::vector<double> all;
  const auto stopped_after = [&](int calls) {
    JobContext job;
    std::vector<double> fractions;
    job.progress = [&](const std::string&, double fraction) {
      fractions.push_back(fraction);
      if (static_cast<int>(fractions.size()) == calls) job.cancellation.request();
    };
    try {
      (void)modal_analysis(body, {}, job);
      all = fractions;
      return -1;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kCancelled);
      return static_cast<int>(fractions.size());
    }
  };
  ASSERT_EQ(stopped_after(0), -1);
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
  EXPECT_EQ(all.front(), 0);
  EXPECT_EQ(all.back(), 1);
  // The factor and what surrounds it take the longest on large bodies.
  const auto early = [](double fraction) { return fraction > 0 && fraction < 0.5; };
  EXPECT_GE(std::count_if(all.begin(), all.end(), early), 6);
  for (const int calls : {1, 2, 3, 4, 5, 8, 20, static_cast<int>(all.size()) - 1})
    EXPECT_EQ(stopped_after(calls), calls);
}

TEST(ModalAnalysis, RefusesBadOptions) {
  const auto field_of = [](const ModalOptions& options) {
    try {
      options.validate();
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(field_of({0, 1e-8, 300}), "mode_count");
  EXPECT_EQ(field_of({1, 0, 300}), "tolerance");
  EXPECT_EQ(field_of({1, std::nan(""), 300}), "tolerance");
  EXPECT_EQ(field_of({1, 1e-8, 0}), "max_restarts");
  EXPECT_EQ(field_of({1, 1e-8, 1}), "accepted");
}

}  // namespace
}  // namespace limber::bodies
