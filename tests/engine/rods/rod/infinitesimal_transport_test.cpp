#include "tests/engine/rods/rod/infinitesimal_transport.h"

#include <gtest/gtest.h>

namespace limber::rods {
namespace {

using namespace limber::rods::testing;

Sample without_stretch() {
  Sample s = sample({5}, BendingForm::kMaterialFrames);
  for (int slot = 0; slot < 5; ++slot) s.parameters(slot, RodParameters::kStretching) = 0;
  return s;
}

TEST(InfinitesimalTransport, HasTheSameGradientAtTheSourceOnly) {
  const Sample s = without_stretch();
  const RodAtSource at = s.at_source();
  const Eigen::VectorXd expected = infinitesimal_gradient(at.state(), s.parameters);
  EXPECT_LT((at.state().gradient(s.parameters) - expected).norm(), 1e-13 * expected.norm());
  EXPECT_GT((s.state().gradient(s.parameters) - expected).norm(), 1e-3 * expected.norm());
}

TEST(InfinitesimalTransport, HasAnAsymmetricDerivativeWhoseSymmetricPartIsTheHessian) {
  const Sample s = without_stretch();
  const RodAtSource at = s.at_source();
  const double h = 1e-5;
  Eigen::MatrixXd jacobian(s.layout->unknowns(), s.layout->unknowns());
  for (int i = 0; i < s.layout->unknowns(); ++i) {
    Eigen::VectorXd above = s.unknowns, below = s.unknowns;
    above[i] += h;
    below[i] -= h;
    jacobian.col(i) = (infinitesimal_gradient(at.moved(above), s.parameters) -
                       infinitesimal_gradient(at.moved(below), s.parameters)) /
                      (2 * h);
  }
  const Eigen::MatrixXd symmetric = 0.5 * (jacobian + jacobian.transpose());
  const Eigen::MatrixXd hessian = dense(*s.layout, at.hessian(s.parameters));
  EXPECT_GT((jacobian - symmetric).norm(), 1e-2 * jacobian.norm());
  EXPECT_LT((hessian - symmetric).norm(), 1e-8 * hessian.norm());
}

TEST(InfinitesimalTransport, MakesTheEnergyDependOnThePath) {
  const Sample s = without_stretch();
  const RodAtSource fixed = s.at_source();
  const double before = fixed.state().energy(s.parameters);
  RodAtSource at = fixed;  // frames follow step by step
  constexpr int kSteps = 400;
  for (int step = 1; step <= kSteps; ++step) {
    const double phi = 2 * 3.14159265358979323846 * step / kSteps;
    Eigen::VectorXd x = s.unknowns;
    x[4 * 5 + 1] += 0.5 * std::sin(phi);
    x[4 * 5 + 2] += 0.5 * (1 - std::cos(phi));
    if (step == kSteps) x = s.unknowns;
    at = RodAtSource(at.moved(x));
  }
  EXPECT_GT(std::abs(at.state().energy(s.parameters) - before), 1e-2 * before);
  EXPECT_NEAR(fixed.moved(s.unknowns).energy(s.parameters), before, 1e-13 * before);
}

}  // namespace
}  // namespace limber::rods
