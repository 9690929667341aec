#include "tests/support/rod_derivatives.h"

#include <gtest/gtest.h>

#include "tests/engine/rods/rod/rod_samples.h"

namespace limber::rods {
namespace {

using namespace limber::rods::testing;

class RodDerivatives : public ::testing::TestWithParam<BendingForm> {
 protected:
  static RodParameters parameter_direction(const RodLayout& layout) {
    RodParameters result = RodParameters::direction(layout);
    const Eigen::VectorXd values = random_vector(layout.nodes() * RodParameters::kParameters, 11);
    for (int slot = 0; slot < layout.nodes(); ++slot)
      for (int k = 0; k < RodParameters::kParameters; ++k)
        result(slot, static_cast<RodParameters::Parameter>(k)) =
            values[slot * RodParameters::kParameters + k];
    return result;
  }
  static RodParameters stepped(const RodParameters& p, const RodParameters& direction, double h,
                               int nodes) {
    RodParameters result = p;
    for (int slot = 0; slot < nodes; ++slot)
      for (int k = 0; k < RodParameters::kParameters; ++k) {
        const auto which = static_cast<RodParameters::Parameter>(k);
        result(slot, which) += h * direction(slot, which);
      }
    return result;
  }
};

TEST_P(RodDerivatives, HessianVectorProductAtTheSourceIsTheHessian) {
  const Sample s = sample({6, 3}, GetParam());
  const RodAtSource at = s.at_source();
  const Eigen::MatrixXd hessian = dense(*s.layout, at.hessian(s.parameters));
  const Eigen::VectorXd v = random_vector(s.layout->unknowns(), 5);
  const Eigen::VectorXd product = gradient_derivative(at.state(), s.parameters, {v, nullptr});
  EXPECT_LT((product - hessian * v).norm(), 1e-13 * product.norm());
}

TEST_P(RodDerivatives, HessianVectorProductFarFromTheSourceIsTheHessianThere) {
  const Sample s = sample({6, 3}, GetParam());
  const Eigen::MatrixXd hessian = dense(*s.layout, transported_hessian(s.state(), s.parameters));
  const Eigen::VectorXd v = random_vector(s.layout->unknowns(), 6);
  const Eigen::VectorXd product = gradient_derivative(s.state(), s.parameters, {v, nullptr});
  EXPECT_LT((product - hessian * v).norm(), 1e-13 * product.norm());
}

TEST_P(RodDerivatives, OfGradientAndHessianAgreeWithDifferences) {
  const Sample s = sample({6, 3}, GetParam());
  const RodAtSource at = s.at_source();
  const Eigen::VectorXd v = random_vector(s.layout->unknowns(), 8);
  const RodParameters p = parameter_direction(*s.layout);
  for (const bool from_afar : {false, true}) {
    const RodState state = from_afar ? s.state() : at.state();
    const RodDirection direction{v, &p};
    const double h = 1e-5;
    const auto side = [&](double step) {
      return std::pair{RodState(s.layout, state.shared_source(), s.unknowns + step * v),
                       stepped(s.parameters, p, step, s.layout->nodes())};
    };
    const auto [above, above_p] = side(h);
    const auto [below, below_p] = side(-h);
    const Eigen::VectorXd gradient = gradient_derivative(state, s.parameters, direction);
    const Eigen::VectorXd difference =
        (above.gradient(above_p) - below.gradient(below_p)) / (2 * h);
    EXPECT_LT((gradient - difference).norm(), 1e-7 * gradient.norm());
    const Eigen::MatrixXd hessian =
        dense(*s.layout, hessian_derivative(state, s.parameters, direction));
    const Eigen::MatrixXd hessian_difference =
        (dense(*s.layout, transported_hessian(above, above_p)) -
         dense(*s.layout, transported_hessian(below, below_p))) /
        (2 * h);
    EXPECT_LT((hessian - hessian_difference).norm(), 1e-7 * hessian.norm());
    EXPECT_GT(hessian.norm(), 1);
  }
}

TEST_P(RodDerivatives, ThirdDerivativesAreSymmetric) {
  // d/du of H v equals d/dv of H u: differentiation order does not matter.
  const Sample s = sample({6}, GetParam());
  const RodState state = s.at_source().state();
  const Eigen::VectorXd u = random_vector(s.layout->unknowns(), 1);
  const Eigen::VectorXd v = random_vector(s.layout->unknowns(), 2);
  const Eigen::VectorXd uv =
      dense(*s.layout, hessian_derivative(state, s.parameters, {u, nullptr})) * v;
  const Eigen::VectorXd vu =
      dense(*s.layout, hessian_derivative(state, s.parameters, {v, nullptr})) * u;
  EXPECT_LT((uv - vu).norm(), 1e-13 * uv.norm());
}

INSTANTIATE_TEST_SUITE_P(Forms, RodDerivatives,
                         ::testing::Values(BendingForm::kMaterialFrames,
                                           BendingForm::kAveragedFrames,
                                           BendingForm::kTurningAngle));

}  // namespace
}  // namespace limber::rods
