// Single rods: energies and derivatives of discrete elastic rods, by Newton's method of the tests.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/stability/elastica.h"
#include "bench/stability/sweep.h"
#include "tests/support/rod_problems.h"

namespace limber::bench::stability {
namespace {

using rods::AtSaddle;
using rods::BendingForm;
using rods::RestShape;
using rods::Rod;
using rods::RodAtSource;
using rods::RodReport;
using rods::RodState;
using rods::RodStatus;
using rods::SectionStiffness;

constexpr SectionStiffness kFlatRod{1e4, 2.0, 0.5, 0.8};
constexpr int kEdges = 40;

Finding finding_of(const RodReport& report, const Eigen::VectorXd& unknowns) {
  Finding finding;
  finding.claim = report.status == RodStatus::kConverged && report.stable ? Claim::kConverged
                                                                          : Claim::kNotConverged;
  finding.is_finite = unknowns.allFinite() && std::isfinite(report.energies.total());
  finding.message = fmt::format("{} iterations, residual {:.2g}, {}", report.iterations,
                                report.residual, report.stable ? "stable" : "not stable");
  return finding;
}

Finding cantilever_tip_of(double alpha, double modulus, double length, double height) {
  // Near the root a large load bends the rod over 1 / sqrt(alpha) of its length.
  const int edges = std::max(kEdges, static_cast<int>(20 * std::sqrt(alpha)));
  const auto found = testing::cantilever_shape(edges, alpha, modulus, length, height,
                                               BendingForm::kMaterialFrames);
  const Eigen::VectorXd& x = found.at.state().unknowns();
  Finding finding = finding_of(found.report, x);
  const ElasticaTip tip = cantilever_tip(alpha);
  finding.error =
      (x.segment<2>(4 * edges) / length - Eigen::Vector2d(tip.along, tip.deflection)).norm();
  // Stretching: P L / EA, and the error of forty edges.
  const double thickness = height / length;
  finding.allowed = 1e-3 + alpha * thickness * thickness / 12;
  return finding;
}

Eigen::Matrix3Xd straight(int edges, double h) {
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  for (int i = 0; i <= edges; ++i) nodes(0, i) = i * h;
  return nodes;
}

std::vector<char> with_first_edge_held(const Rod& rod) {
  std::vector<char> fixed(static_cast<std::size_t>(rod.layout->unknowns()), 0);
  std::fill_n(fixed.begin(), 7, char{1});
  return fixed;
}

/// An edge folded back onto the one before but for this angle [rad]: it must unfold.
Finding unfolded(double missing) {
  Eigen::Matrix3Xd nodes = straight(4, 1);
  const Eigen::Vector3d back(-std::cos(missing), std::sin(missing), 0);
  nodes.col(3) = nodes.col(2) + back;
  nodes.col(4) = nodes.col(3) + back;
  const Rod rod(nodes, kFlatRod, {.rest = RestShape::kStraight});
  const auto found = find_equilibrium(rod.drawn, rod.parameters, {}, with_first_edge_held(rod));
  Finding finding = finding_of(found.report, found.at.state().unknowns());
  finding.error = found.report.energies.total();
  finding.allowed = 1e-8;
  return finding;
}

/// A straight rod between two clamps, its last frame turned in quarters.
Finding twisted(double turns) {
  const Rod rod(straight(10, 0.1), kFlatRod, {.rest = RestShape::kStraight});
  std::vector<char> fixed(static_cast<std::size_t>(rod.layout->unknowns()), 1);
  for (std::size_t i = 1; i < 9; ++i) fixed[4 * i + 3] = 0;
  RodState state = rod.drawn;
  RodReport report;
  const int quarters = static_cast<int>(4 * turns);
  for (int quarter = 1; quarter <= quarters; ++quarter) {
    Eigen::VectorXd x = state.unknowns();
    x[4 * 9 + 3] = quarter * std::numbers::pi / 2;
    const auto found = find_equilibrium(RodAtSource(state).moved(x), rod.parameters, {}, fixed);
    report = found.report;
    state = found.at.state();
    if (report.status != RodStatus::kConverged) break;
  }
  Finding finding = finding_of(report, state.unknowns());
  const double twist = 2 * std::numbers::pi * turns;
  finding.error = std::abs(state.energy(rod.parameters) / (0.5 * 0.8 * twist * twist / 0.9) - 1);
  finding.allowed = 1e-8;
  return finding;
}

Finding compressed(double span, testing::Ends ends) {
  const testing::RodAnswer answer =
      testing::compressed(kEdges, ends, span, compressed_height(span));
  Finding finding = finding_of(answer.report, answer.nodes.reshaped());
  finding.error = answer.error;
  finding.allowed = 0.01;
  return finding;
}

/// Edges drawn so many times shorter than they are at rest.
Finding expanding(double share) {
  Eigen::Matrix3Xd nodes(3, 13);
  for (int i = 0; i < 13; ++i) nodes.col(i) << std::cos(0.4 * i), std::sin(0.4 * i), 0.1 * i;
  const Rod drawn(nodes, kFlatRod);
  const Rod tiny(share * nodes, kFlatRod);
  const auto found = find_equilibrium(
      RodState(drawn.layout, drawn.drawn.shared_source(), tiny.drawn.unknowns()), drawn.parameters,
      {}, std::vector<char>(static_cast<std::size_t>(drawn.layout->unknowns()), 0));
  Finding finding = finding_of(found.report, found.at.state().unknowns());
  // Nothing holds it, so that it is never stable.
  if (found.report.status == RodStatus::kConverged) finding.claim = Claim::kConverged;
  finding.error = found.report.energies.total();
  finding.allowed = 1e-8;
  return finding;
}

Sweep rod_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "rods";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "a cantilever of 40 edges with a load at its tip";
  sweep.check = "the elastica, by elliptic integrals";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps rod_sweeps() {
  Sweep fold = rod_sweep("an edge folded back", "angle that is missing [rad]", decades(-1, -12, -1),
                         6, unfolded);
  fold.asked = "a rod that is straight at rest unfolds";
  fold.check = "its energy, which is zero";
  Sweep twist = rod_sweep("twist", "turns", {0.25, 0.5, 1, 10, 100, 1000}, 5, twisted);
  twist.asked = "a straight rod between clamps, one of them turned in quarters";
  twist.check = "energy of pure torsion";
  Sweep grow = rod_sweep("edges drawn short", "drawn length over that at rest", decades(-1, -9, -1),
                         3, expanding);
  grow.asked = "a free helix expands";
  grow.check = "its energy, which is zero";
  Sweeps sweeps = {
      rod_sweep("slenderness", "length over thickness", decades(1, 8), 4,
                [](double value) { return cantilever_tip_of(1, 1e9, 1, 1 / value); }),
      rod_sweep("size", "length of the rod [m]", {1, 1e-3, 1e3, 1e-6, 1e-9}, 5,
                [](double value) { return cantilever_tip_of(1, 2e11, value, value / 100); }),
      rod_sweep("stiffness", "Young's modulus [Pa]", decades(-6, 18, 3), 9,
                [](double value) { return cantilever_tip_of(1, value, 1, 0.01); }),
      rod_sweep("load", "P L^2 / EI", decades(-8, 2), 11,
                [](double value) { return cantilever_tip_of(value, 1e9, 1, 1e-3); }),
      fold,
      twist,
      grow,
  };
  for (const auto ends : {testing::Ends::kHinged, testing::Ends::kClamped}) {
    Sweep sweep = rod_sweep(
        ends == testing::Ends::kHinged ? "compressed between hinges" : "compressed between clamps",
        "span over length", {0.99, 0.9, 0.7, 0.5, 0.3, 0.2, 0.15}, 5,
        [=](double span) { return compressed(span, ends); });
    sweep.asked = "a straight rod of 40 edges whose ends are brought together";
    sweeps.push_back(sweep);
  }
  return sweeps;
}

}  // namespace limber::bench::stability
