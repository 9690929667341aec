// lambda = 0: the motion between targets is a discrete cubic spline, known in closed form.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "tests/support/dense.h"

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"

namespace limber::spacetime {
namespace {

/// min 1/2 sum (z_(i-1) - 2 z_i + z_(i+1))^2 + sum w_c / 2 (t_c - z(f_c))^2 over all N frames.
/// The fourth difference vanishes but in the knots f_c, so z_i = a + b i + sum mu_c G(i - f_c) with
/// G(j) = (j^3 - j) / 6 for j > 0, whose second difference is max(j, 0). Free ends: sum mu = 0 and
/// sum mu f = 0. In a knot the forces balance: mu_c = w_c (t_c - z(f_c)), or z = t if exact.
class DiscreteSpline {
 public:
  struct Knot {
    int frame;
    Real target, weight;  // infinite: exact
  };

  DiscreteSpline(std::vector<Knot> knots, int frame_count)
      : knots_(std::move(knots)), frames_(frame_count) {
    const auto count = static_cast<Eigen::Index>(knots_.size());
    DenseMatrix system = DenseMatrix::Zero(count + 2, count + 2);
    DenseVector right = DenseVector::Zero(count + 2);
    for (Eigen::Index row = 0; row < count; ++row) {
      const Knot& knot = knots_[static_cast<std::size_t>(row)];
      for (Eigen::Index c = 0; c < count; ++c)
        system(row, c) = kernel(knot.frame - knots_[static_cast<std::size_t>(c)].frame);
      system(row, count) = 1;
      system(row, count + 1) = scaled(knot.frame);
      if (std::isfinite(knot.weight)) system(row, row) += 1 / (knot.weight * cube());
      right[row] = knot.target;
      system(count, row) = 1;
      system(count + 1, row) = scaled(knot.frame);
    }
    solution_ = reference::solve_in_long_double(system, right);
  }

  [[nodiscard]] Real at(int frame) const {
    const auto count = static_cast<Eigen::Index>(knots_.size());
    Real sum = solution_[count] + solution_[count + 1] * scaled(frame);
    for (Eigen::Index c = 0; c < count; ++c)
      sum += solution_[c] * kernel(frame - knots_[static_cast<std::size_t>(c)].frame);
    return sum;
  }

  /// E_f: the second difference in frame i is sum mu_c max(i - f_c, 0).
  [[nodiscard]] Real force_energy() const {
    Real energy = 0;
    for (int i = 1; i + 1 < frames_; ++i) {
      Real second = 0;
      for (std::size_t c = 0; c < knots_.size(); ++c) {
        if (i > knots_[c].frame)
          second += solution_[static_cast<Eigen::Index>(c)] * scaled(i - knots_[c].frame);
      }
      energy += second * second / 2;
    }
    return energy * scaled(1) * scaled(1) * scaled(1) * scaled(1);
  }

 private:
  // mu is kept times N^3 and frames are divided by N, so that the dense system is of order one.
  [[nodiscard]] Real scaled(int frame) const { return static_cast<Real>(frame) / frames_; }
  [[nodiscard]] Real cube() const { return static_cast<Real>(frames_) * frames_ * frames_; }
  [[nodiscard]] Real kernel(int j) const {
    if (j <= 0) return 0;
    const Real x = scaled(j);
    return (x * x * x - x * scaled(1) * scaled(1)) / 6;
  }

  std::vector<Knot> knots_;
  int frames_;
  DenseVector solution_;
};

constexpr int kManyFrames = 20000;

struct Case {
  const char* name;
  EndCondition first, last;
  double weight;
};
std::ostream& operator<<(std::ostream& out, const Case& tested) { return out << tested.name; }

class FreeBodyTwentyThousandFrames : public ::testing::TestWithParam<Case> {};

TEST_P(FreeBodyTwentyThousandFrames, FollowsTheCubicSpline) {
  const auto kinematics =
      std::make_shared<testing::LinearKinematics>(testing::LinearKinematics::translation(2.0));
  ModeDynamics dynamics{Eigen::VectorXd::Zero(3), Eigen::VectorXd::Zero(3)};
  Solver solver(kinematics, dynamics, {kManyFrames, GetParam().first, GetParam().last});
  const int frames[] = {1200, 4000, 4001, 9000, 15000, 18300};
  std::mt19937_64 generator(61);
  std::vector<DiscreteSpline::Knot> knots[3];
  for (const int frame : frames) {
    PositionConstraint constraint;
    constraint.id = static_cast<ConstraintId>(frame);
    constraint.frame = frame;
    constraint.weight = GetParam().weight;
    for (auto& value : constraint.target) value = testing::uniform(generator);
    // Neighbouring frames must differ by little, or the spline is all one spike.
    if (frame == 4001) constraint.target = solver.constraints().back().target * 1.0001;
    solver.add(constraint);
    for (int axis = 0; axis < 3; ++axis) {
      knots[axis].push_back(
          {frame, static_cast<Real>(constraint.target[axis]) / 2, constraint.weight});
    }
  }
  const Real exact = INFINITY;
  for (auto& axis : knots) {
    for (int i = 0; i < static_cast<int>(GetParam().first); ++i) axis.push_back({i, 0, exact});
    for (int i = 0; i < static_cast<int>(GetParam().last); ++i)
      axis.push_back({kManyFrames - 1 - i, 0, exact});
  }
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  Real energy = 0;
  double worst = 0, largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const DiscreteSpline spline(knots[axis], kManyFrames);
    energy += spline.force_energy();
    for (int i = 0; i < kManyFrames; i += 37) {
      const double expected = static_cast<double>(spline.at(i));
      worst = std::max(worst, std::abs(solver.motion()(axis, i) - expected));
      largest = std::max(largest, std::abs(expected));
    }
  }
  EXPECT_GT(energy, 0);
  EXPECT_NEAR(report.force_energy / static_cast<double>(energy), 1, 1e-6);
  EXPECT_LE(worst, 1e-6 * largest);
}

using enum EndCondition;
INSTANTIATE_TEST_SUITE_P(
    Ends, FreeBodyTwentyThousandFrames,
    ::testing::Values(Case{"NaturalSoft", kFree, kFree, 100},
                      Case{"NaturalExact", kFree, kFree, PositionConstraint::kExact},
                      Case{"ClampedSoft", kPinnedPositionVelocity, kPinnedPositionVelocity, 100},
                      Case{"ClampedExact", kPinnedPositionVelocity, kPinnedPositionVelocity,
                           PositionConstraint::kExact},
                      Case{"PositionSoft", kPinnedPosition, kPinnedPosition, 100},
                      Case{"MixedSoft", kFree, kPinnedPositionVelocity, 1e-8}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace limber::spacetime
