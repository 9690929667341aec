// The one conformance suite on the energies of rods, in every form.

#include <gtest/gtest.h>

#include "tests/support/dense.h"

#include "engine/base/rotations/exponential_map.h"
#include "tests/engine/rods/rod/rod_samples.h"
#include "tests/support/energy_conformance.h"

namespace limber::rods {
namespace {

using namespace limber::rods::testing;
using limber::testing::EnergyUnderTest;

enum class Term { kAll, kStretching, kBending1, kBending2, kTwisting };

struct TermCase {
  BendingForm form;
  Term term;
};

RodParameters only(const Sample& sample, Term term) {
  using P = RodParameters;
  RodParameters result = sample.parameters;
  for (int slot = 0; slot < sample.layout->nodes(); ++slot) {
    for (const auto& [parameter, of] :
         {std::pair{P::kStretching, Term::kStretching}, std::pair{P::kBending1, Term::kBending1},
          std::pair{P::kBending2, Term::kBending2}, std::pair{P::kTorsion, Term::kTwisting}}) {
      if (term != Term::kAll && term != of) result(slot, parameter) = 0;
    }
  }
  return result;
}

class RodEnergyConformance : public ::testing::TestWithParam<TermCase> {};

TEST_P(RodEnergyConformance, AtTheSourceFrame) {
  const Sample s = sample({6}, GetParam().form);
  const RodParameters parameters = only(s, GetParam().term);
  const RodAtSource at = s.at_source();
  EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& x) { return at.moved(x).energy(parameters); };
  energy.gradient = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    return at.moved(x).gradient(parameters);
  };
  energy.hessian = [&](const Eigen::VectorXd& x) -> Eigen::MatrixXd {
    EXPECT_EQ(x, s.unknowns);  // the one place where this Hessian is meant
    return dense(*s.layout, at.hessian(parameters));
  };
  limber::testing::expect_conforms(energy, s.unknowns);
}

TEST_P(RodEnergyConformance, FarFromTheSourceFrame) {
  const Sample s = sample({6}, GetParam().form);
  const RodParameters parameters = only(s, GetParam().term);
  const auto state = [&](const Eigen::VectorXd& x) { return RodState(s.layout, s.source, x); };
  EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& x) { return state(x).energy(parameters); };
  energy.gradient = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    return state(x).gradient(parameters);
  };
  energy.hessian = [&](const Eigen::VectorXd& x) -> Eigen::MatrixXd {
    return dense(*s.layout, transported_hessian(state(x), parameters));
  };
  limber::testing::expect_conforms(energy, s.unknowns);
}

constexpr auto k2010 = BendingForm::kAveragedFrames;
constexpr auto kTurning = BendingForm::kTurningAngle;
INSTANTIATE_TEST_SUITE_P(
    Terms, RodEnergyConformance,
    ::testing::Values(TermCase{k2008, Term::kAll}, TermCase{k2010, Term::kAll},
                      TermCase{k2008, Term::kStretching}, TermCase{k2008, Term::kBending1},
                      TermCase{k2008, Term::kBending2}, TermCase{k2010, Term::kBending1},
                      TermCase{k2010, Term::kBending2}, TermCase{k2008, Term::kTwisting},
                      TermCase{kTurning, Term::kAll}, TermCase{kTurning, Term::kBending1},
                      TermCase{kTurning, Term::kBending2}));

TEST(RodEnergy, IsZeroAtRestForAnyShapeAtRest) {
  for (const auto form : {k2008, k2010, kTurning}) {
    const Sample s = sample({6, 3}, form);
    RodParameters parameters = s.parameters;
    const RodState state = s.state();
    const double before = state.energy(parameters), force = state.gradient(parameters).norm();
    state.set_as_rest(parameters);
    EXPECT_GT(before, 1);
    EXPECT_LT(state.energy(parameters), 1e-25 * before);
    EXPECT_LT(state.gradient(parameters).norm(), 1e-13 * force);
    // And it is a minimum, with the six rigid motions of each rod and its unused angle left.
    const Eigen::VectorXd spectrum =
        reference::symmetric_eigenvalues(dense(*s.layout, RodAtSource(state).hessian(parameters)));
    const double largest = spectrum.maxCoeff();
    EXPECT_GT(spectrum[0], -1e-13 * largest);
    EXPECT_LT(spectrum[13], 1e-13 * largest);
    EXPECT_GT(spectrum[14], 1e-5 * largest);
  }
}

TEST(RodEnergy, DoesNotChangeUnderRigidMotionWithItsSource) {
  const Sample s = sample({8}, k2008);
  const Eigen::Matrix3d rotation = rotations::exponential({0.9, -1.4, 2.0});
  const Eigen::VectorXd before = random_vector(s.layout->unknowns(), 3) +
                                 Eigen::VectorXd::LinSpaced(s.layout->unknowns(), 0, 40);
  const Eigen::Vector3d director(0.1, 0.5, 1), shift(3, -1, 7);
  const auto build = [&](const Eigen::VectorXd& from, const Eigen::Vector3d& d,
                         const Eigen::VectorXd& to) {
    return RodState(s.layout,
                    std::make_shared<const SourceFrames>(
                        SourceFrames::without_twist(*s.layout, from, Eigen::Matrix3Xd(d))),
                    to);
  };
  const RodState here = build(before, director, s.unknowns);
  const RodState there = build(moved(*s.layout, before, rotation, shift), rotation * director,
                               moved(*s.layout, s.unknowns, rotation, shift));
  const double energy = here.energy(s.parameters);
  EXPECT_NEAR(there.energy(s.parameters), energy, 1e-13 * energy);
  const Eigen::VectorXd turned =
      moved(*s.layout, here.gradient(s.parameters), rotation, Eigen::Vector3d::Zero());
  EXPECT_LT((there.gradient(s.parameters) - turned).norm(), 1e-12 * turned.norm());
}

TEST(RodEnergy, ForcesAndMomentsOfAFreeRodBalance) {
  const Sample s = sample({9}, k2008);
  const RodState state = RodAtSource(s.state()).state();
  const Eigen::VectorXd g = state.gradient(s.parameters);
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (int slot = 0; slot < s.layout->nodes(); ++slot) {
    const Eigen::Vector3d f = g.segment<3>(4 * slot), x = s.unknowns.segment<3>(4 * slot);
    force += f;
    moment += x.cross(f);
    if (!s.layout->is_edge(slot)) continue;
    const auto t = state.frame(slot).tangent;
    moment += g[4 * slot + 3] * Eigen::Vector3d(t.x, t.y, t.z);
  }
  EXPECT_LT(force.norm(), 1e-13 * g.norm());
  EXPECT_LT(moment.norm(), 1e-12 * g.norm());
}

TEST(RodEnergy, DoesNotChangeWhenAllAnglesTurnTogetherIfBendingIsIsotropic) {
  Sample s = sample({7}, k2008);
  using P = RodParameters;
  for (int slot = 1; slot < 7; ++slot) {
    s.parameters(slot, P::kBending2) = s.parameters(slot, P::kBending1);
    for (const auto p : {P::kRestBefore1, P::kRestBefore2, P::kRestAfter1, P::kRestAfter2})
      s.parameters(slot, p) = 0;
  }
  Eigen::VectorXd turned = s.unknowns;
  for (int slot = 0; slot < 7; ++slot) turned[4 * slot + 3] += 2.3;
  const double energy = s.state().energy(s.parameters);
  EXPECT_NEAR(RodState(s.layout, s.source, turned).energy(s.parameters), energy, 1e-13 * energy);
}

TEST(RodEnergy, OfSeveralRodsIsTheSumOfEach) {
  const Sample all = sample({5, 1, 8, 2}, k2008);
  double sum = 0;
  const RodState state = all.state();
  const auto forces = state.forces(all.parameters);
  for (int r = 0; r < all.layout->rods(); ++r) {
    const int first = all.layout->first_node(r), nodes = all.layout->edges(r) + 1;
    const auto layout = std::make_shared<const RodLayout>(std::vector<int>{nodes - 1});
    RodParameters p(*layout);
    p.form = all.parameters.form;
    for (int i = 0; i < nodes; ++i)
      for (int k = 0; k < RodParameters::kParameters; ++k)
        p(i, static_cast<RodParameters::Parameter>(k)) =
            all.parameters(first + i, static_cast<RodParameters::Parameter>(k));
    Eigen::Matrix3Xd directors(3, nodes);
    Eigen::VectorXd from(4 * nodes);
    // The source of the others is not public by rods; the present frames are.
    for (int i = 0; i < nodes; ++i) {
      directors.col(i).setUnit(0);
      if (i < nodes - 1) {
        const auto f = state.frame(first + i);
        directors.col(i) << f.d1.x, f.d1.y, f.d1.z;
      }
    }
    const Eigen::VectorXd x = all.unknowns.segment(4 * first, 4 * nodes);
    Eigen::VectorXd untwisted = x;
    for (int i = 0; i < nodes; ++i) untwisted[4 * i + 3] = 0;
    const RodState alone(
        layout,
        std::make_shared<const SourceFrames>(SourceFrames::from_directors(*layout, x, directors)),
        untwisted);
    sum += alone.energy(p);
    EXPECT_LT((alone.gradient(p).head(3) -
               RodAtSource(state).state().gradient(all.parameters).segment(4 * first, 3))
                  .norm(),
              1e-11 * forces.gradient.norm());
  }
  EXPECT_NEAR(forces.energies.total(), sum, 1e-12 * sum);
}

}  // namespace
}  // namespace limber::rods
