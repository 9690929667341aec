#include "tests/support/charted_element.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/rotations/exponential_map.h"
#include "engine/beams/element/element_energy.h"
#include "tests/support/energy_conformance.h"
#include "tests/support/normal_chart.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;
using Kind = ChartedReference::Kind;

ChartedElement element() { return {0.5, 40, 0.7, 1.3, 0.9}; }

ChartedVector unknowns() {
  ChartedVector u;
  u << 0.1, -0.2, 0.3, 0.15, -0.1, 0.2, 0.55, -0.1, 0.4, -0.2, 0.25, -0.3;
  return u;
}

/// The references' vectors are unknowns too: they depend on positions of other nodes.
constexpr int kAll = 18;

ChartedReferences with_vectors(ChartedReferences references, const Eigen::VectorXd& u) {
  for (std::size_t i = 0; i < 2; ++i) {
    if (references[i].kind == Kind::kElement)
      references[i].vector = u.segment<3>(12 + 3 * static_cast<int>(i));
  }
  return references;
}

void expect_element_conforms(const ChartedReferences& references, const ChartedVector& at) {
  limber::testing::EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& u) {
    return charted_energy(element(), with_vectors(references, u), u.head<12>());
  };
  energy.gradient = [&](const Eigen::VectorXd& u) -> Eigen::VectorXd {
    const ChartedGradient g =
        charted_gradient(element(), with_vectors(references, u), u.head<12>());
    Eigen::VectorXd all(kAll);
    all.head<12>() = g.unknowns;
    for (std::size_t i = 0; i < 2; ++i) {
      const bool moves = references[i].kind == Kind::kElement;
      all.segment<3>(12 + 3 * static_cast<int>(i)) = moves ? g.references[i] : Vector3d::Zero();
    }
    return all;
  };
  Eigen::VectorXd state(kAll);
  state.head<12>() = at;
  state.segment<3>(12) = references[0].vector;
  state.segment<3>(15) = references[1].vector;
  limber::testing::expect_conforms(energy, state);
}

std::vector<ChartedReferences> kinds_of_references() {
  const ChartedReference itself;
  const ChartedReference other{Kind::kElement, {0.3, 0.4, -0.1}, -0.6};
  const ChartedReference another{Kind::kElement, {-0.2, 0.5, 0.2}, -1.9};
  const ChartedReference held{Kind::kAtRest, {0.4, 0.2, 0.1}, 0};
  return {{itself, itself}, {other, another}, {itself, other}, {held, another}, {held, itself}};
}

TEST(ChartedElement, ConformsInsideAndOutsideTheDisc) {
  ChartedVector outside = unknowns();
  outside[9] = -0.9;
  outside[10] = 0.8;
  for (const ChartedReferences& references : kinds_of_references()) {
    expect_element_conforms(references, unknowns());
    expect_element_conforms(references, outside);
  }
}

TEST(ChartedElement, AgreesWithTheFramesWhereAnglesAreSmall) {
  // An element along x that bends about axis 2, then about axis 3: the same energy to the square of
  // the angles, for any origin of the rotation about the normal.
  const double a = 0.02, b = -0.03;
  ElementConstants<double> k;
  k.length = 0.5;
  k.near_2 = 4 * 1.3 / 0.5, k.far_2 = 2 * 1.3 / 0.5;
  k.near_3 = 4 * 0.9 / 0.5, k.far_3 = 2 * 0.9 / 0.5;
  ElementEnds ends;
  ends.start = Vector3d::Zero();
  ends.finish = Vector3d(0.5, 0, 0);
  ChartedVector u = ChartedVector::Zero();
  u[6] = 0.5;

  ChartedVector about_2 = u;
  about_2[3] = std::sin(a);
  about_2[9] = std::sin(b);
  ends.start_axes = rotations::exponential({0, a, 0});
  ends.finish_axes = rotations::exponential({0, b, 0});
  double frames = element_energies(k, ends).total();
  EXPECT_NEAR(charted_energy(element(), {}, about_2), frames, 1e-3 * frames);

  ChartedVector about_3 = u;
  about_3[5] = a;
  about_3[11] = b;
  ends.start_axes = rotations::exponential({0, 0, a});
  ends.finish_axes = rotations::exponential({0, 0, b});
  frames = element_energies(k, ends).total();
  EXPECT_NEAR(charted_energy(element(), {}, about_3), frames, 1e-3 * frames);
  // The node's reference is drawn at an angle of 0.7 to the element.
  const Vector3d drawn(std::cos(0.7), -std::sin(0.7), 0);
  ChartedReference other{Kind::kElement, 0.3 * drawn, 0};
  other.alpha = charted_alpha({0, 0, 2}, other.vector, {0.5, 0, 0});
  EXPECT_NEAR(other.alpha, 0.7, 1e-14);
  EXPECT_NEAR(charted_energy(element(), {other, other}, about_3), frames, 1e-3 * frames);
}

TEST(ChartedElement, IsAtRestAsDrawn) {
  ChartedVector u = ChartedVector::Zero();
  u[6] = 0.5;
  ChartedReference other{Kind::kElement, {0.1, 0.7, 0}, 0};
  other.alpha = charted_alpha({0, 0, 1}, other.vector, {0.5, 0, 0});
  const ChartedReference held{Kind::kAtRest, {0.5, 0, 0}, 0};
  for (const ChartedReferences& references :
       {ChartedReferences{}, ChartedReferences{other, other}, ChartedReferences{held, other}}) {
    EXPECT_NEAR(charted_energy(element(), references, u), 0, 1e-28);
    EXPECT_LT(charted_gradient(element(), references, u).unknowns.norm(), 1e-14);
  }
}

TEST(ChartedElement, SecondBendingPushesTheOtherEndOfTheReference) {
  // (32): theta_3 depends on the direction of the reference element, so its other node feels it.
  const ChartedReferences references = kinds_of_references()[1];
  const ChartedGradient g = charted_gradient(element(), references, unknowns());
  EXPECT_GT(g.references[0].norm(), 0.1);
  EXPECT_NEAR(g.references[0].dot(references[0].vector), 0, 1e-14) << "its length does not matter";
}

TEST(ChartedElement, DerivativeByPositionsNeedsTheTermThat41HasLost) {
  // theta_3 by the reference's direction, as (40), (33), (41), (38) and (50) have it, and with the
  // term of (35) that (41) leaves out.
  const Vector3d n = Vector3d(0.1, -0.2, 0.9).normalized(), t1 = Vector3d(1, 0.3, 0.2).normalized();
  const Vector3d k = Vector3d(0.4, 0.9, -0.1).normalized(), along(0.3, -0.5, 0.7);
  const double angle = -0.8;  // n_r + alpha
  const auto f1_of = [&](const Vector3d& direction) -> Vector3d {
    return (direction - direction.dot(n) * n).normalized();
  };
  const auto theta = [&](double step) {
    const Vector3d f1 = f1_of((k + step * along).normalized());
    return t1.cross(std::cos(angle) * f1 + std::sin(angle) * n.cross(f1)).dot(n);
  };
  const double difference = (theta(1e-6) - theta(-1e-6)) / 2e-6;
  const Vector3d by_k = along - along.dot(k) * k;
  const Vector3d across = k - k.dot(n) * n, f1 = across.normalized();
  const Vector3d df1 = by_k - by_k.dot(n) * n;
  const Vector3d df1_hat = (df1 - df1.dot(f1) * f1) / across.norm();
  const double printed = t1.cross(std::cos(angle) * df1_hat).dot(n);
  const double full = printed + t1.cross(std::sin(angle) * n.cross(df1_hat)).dot(n);
  EXPECT_NEAR(full, difference, 1e-8);
  EXPECT_GT(std::abs(printed - difference), 0.1);
}

}  // namespace
}  // namespace limber::beams
