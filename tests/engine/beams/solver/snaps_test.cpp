// Snaps are jumps that do not reverse. Buckling is continuous, and no snap.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/solver/reversal.h"
#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"

namespace limber::beams::snaps_test {
namespace {

using limber::testing::clamped;
using limber::testing::Column;
using limber::testing::column_model;
using limber::testing::ColumnEnds;
using limber::testing::shallow_arch;
using limber::testing::straight_beam;

struct Variant {
  std::string name;
  BeamSolveOptions options;
};

/// Those that see snaps along the path: in short steps, and in the long ones of edits of large
/// structures.
std::vector<Variant> watched() {
  BeamSolveOptions live = BeamSolveOptions::live(1000);
  live.factorizations = 0;
  return {{"chosen", {}}, {"live", live}};
}

BeamSolution solved(const BeamModel& model, const BeamSolveOptions& options = {}) {
  return find_equilibrium(BeamStructure(model), options);
}

BeamSolution solved(const BeamModel& model, BeamMethod method) {
  BeamSolveOptions options;
  options.method = method;
  return solved(model, options);
}

/// Unit length along x, clamped at both ends, one of which is brought in by `push`.
BeamModel rod(double push, double slenderness, double torsion) {
  constexpr int kElements = 12;
  BeamModel model = straight_beam(kElements, 1, slenderness);
  model.sections[0].torsion = torsion;
  model.supports = {clamped(0), {kElements, {false, true, true, true, true, true}}};
  PrescribedMotion motion;
  motion.node = kElements;
  motion.translates = {true, false, false};
  motion.translation = {-push, 0, 0};
  model.motions = {motion};
  return model;
}
BeamModel round_rod(double push) { return rod(push, 400, 1 / 1.3); }

constexpr double kSpan = 10, kCable = 10.5;
/// Two slack cables of kCable over spans of kSpan, with a force down where they meet.
BeamModel slack_cable(double force) {
  BeamModel model;
  for (int i = 0; i < 3; ++i) model.nodes.push_back({Eigen::Vector3d(kSpan * i, 0, 0)});
  model.sections = {{5e7, 1, 1, 1}};
  for (int i = 0; i < 2; ++i) {
    BeamElement element;
    element.start = i;
    element.finish = i + 1;
    element.kind = BeamKind::kCable;
    element.rest_length = kCable;
    model.elements.push_back(element);
  }
  model.supports = {{0, {true, true, true, false, false, false}},
                    {2, {true, true, true, false, false, false}}};
  model.loads = {{1, {0, 0, -force}}};
  return model;
}

constexpr double kTrussStiffness = 1e4, kTrussRise = 0.2;
/// Von Mises' truss in its plane: two hinged bars of half-span 1, so stiff that they do not buckle.
BeamModel truss(double load) {
  BeamModel model;
  model.nodes = {{{-1, 0, 0}}, {{0, 0, kTrussRise}}, {{1, 0, 0}}};
  model.sections = {{kTrussStiffness, 100, 100, 100}};
  for (int i = 0; i < 2; ++i) {
    BeamElement bar;
    bar.start = i;
    bar.finish = i + 1;
    bar.start_release.rotations = bar.finish_release.rotations = {false, true, true};
    model.elements.push_back(bar);
  }
  model.supports = {clamped(0), {1, {false, true, false, true, true, true}}, clamped(2)};
  model.loads = {{1, {0, 0, -load}}};
  return model;
}

/// Largest of the load 2 EA (1 / l - 1 / L) z at height z, l^2 = 1 + z^2: where l^3 = L.
double truss_limit_load() {
  const double length = std::hypot(1, kTrussRise);
  const double at_limit = std::cbrt(length);
  return 2 * kTrussStiffness * (1 / at_limit - 1 / length) * std::sqrt(at_limit * at_limit - 1);
}

/// Snaps are told by steps of 1/256 of the path at most, or of the resolution.
double place_error(const BeamSolveOptions& options) {
  return std::max(1.0 / 256, 2 * options.snap_resolution);
}

struct Buckling {
  std::string name;
  BeamModel model;
  double share = 0;  // of the load path, by Euler; 0: not known
};

std::vector<Buckling> plain_buckling() {
  const auto euler = [](double slenderness) {  // between clamps, over a push of 0.1
    return 40 * std::pow(std::numbers::pi / slenderness, 2);
  };
  std::vector<Buckling> cases = {
      {"round rod", round_rod(0.1), euler(400)},
      {"square rod", rod(0.1, 346, 0.843), euler(346)},
      {"flat rod", rod(0.1, 400, 0.3), euler(400)},
      {"slender rod", rod(0.1, 4000, 1 / 1.3), euler(4000)},
      {"arch that rolls aside", shallow_arch(25, limber::testing::ArchMoves::kInSpace), 0}};
  cases[2].model.sections[0].bending_3 = 4;
  for (const ColumnEnds ends :
       {ColumnEnds::kPinnedPinned, ColumnEnds::kClampedFree, ColumnEnds::kClampedGuided}) {
    for (const int elements : {8, 16}) {
      for (const double load : {1.02, 1.5, 10.0}) {
        // Pinned and beyond 2.18 times Euler's load a column turns over.
        if (ends == ColumnEnds::kPinnedPinned && load > 2) continue;
        cases.push_back({fmt::format("{}, {} elements at {}", to_string(ends), elements, load),
                         column_model({ends, elements, load}), 1 / load});
      }
    }
  }
  return cases;
}

TEST(Snaps, PlainBucklingByRelaxationIsNoSnap) {
  for (const auto& [name, model, share] : plain_buckling()) {
    for (const BeamMethod method : {BeamMethod::kRelaxation, BeamMethod::kRelaxationThenNewton}) {
      SCOPED_TRACE(name);
      EXPECT_TRUE(solved(model, method).report.snaps.empty());
    }
  }
}

TEST(Snaps, PlainBucklingIsNoSnap) {
  for (const auto& [name, model, share] : plain_buckling()) {
    for (const Variant& variant : watched()) {
      SCOPED_TRACE(name + ", " + variant.name);
      const BeamSolution found = solved(model, variant.options);
      ASSERT_TRUE(found.report.converged()) << found.report.message;
      EXPECT_TRUE(found.report.snaps.empty()) << found.report.message;
      EXPECT_EQ(found.report.method, BeamMethod::kNewton) << "the branch leads to the end";
    }
  }
}

TEST(Snaps, BucklingIsReportedWithItsLoad) {
  for (const auto& [name, model, share] : plain_buckling()) {
    SCOPED_TRACE(name);
    const BeamReport report = solved(model).report;
    ASSERT_TRUE(report.buckling_share) << report.message;
    if (share > 0) {
      EXPECT_NEAR(*report.buckling_share, share, 0.02 * share);
    }
    EXPECT_NE(report.message.find("it buckles at "), std::string::npos) << report.message;
  }
  EXPECT_FALSE(solved(column_model({ColumnEnds::kClampedFree, 8, 0.9})).report.buckling_share);
  EXPECT_FALSE(solved(limber::testing::cantilever_model(16, 5)).report.buckling_share);
}

TEST(Snaps, ASlackCableIsNoSnap) {
  const double sag = std::sqrt(kCable * kCable - kSpan * kSpan);
  for (const double force : {1.0, 300.0, 3e4}) {
    std::vector<Variant> variants = watched();
    variants.push_back({"Newton", {}});
    variants.back().options.method = BeamMethod::kNewton;
    for (const Variant& variant : variants) {
      const BeamSolution found = solved(slack_cable(force), variant.options);
      ASSERT_TRUE(found.report.converged()) << found.report.message;
      EXPECT_TRUE(found.report.snaps.empty()) << variant.name << " under " << force;
      EXPECT_FALSE(found.report.buckling_share) << variant.name << " under " << force;
      EXPECT_NEAR(-found.state.positions(2, 1), sag, 0.05 * sag);
    }
  }
}

TEST(Snaps, ATrussThroughItsLimitPointIsASnap) {
  const double limit = truss_limit_load();
  for (const Variant& variant : watched()) {
    EXPECT_TRUE(solved(truss(0.95 * limit), variant.options).report.snaps.empty()) << variant.name;
    const BeamSolution found = solved(truss(2 * limit), variant.options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    EXPECT_LT(found.state.positions(2, 1), -kTrussRise) << "it hangs";
    ASSERT_EQ(found.report.snaps.size(), 1U) << variant.name;
    EXPECT_NEAR(found.report.snaps[0].load_factor, 0.5, place_error(variant.options));
  }
}

TEST(Snaps, ATrussThatARelaxationThrowsOverIsASnap) {
  const double limit = truss_limit_load();
  for (const BeamMethod method : {BeamMethod::kRelaxation, BeamMethod::kRelaxationThenNewton}) {
    for (const double share : {0.5, 0.9, 2.0}) {  // brought on at once, 0.9 throws it over, too
      const BeamSolution found = solved(truss(share * limit), method);
      ASSERT_TRUE(found.report.converged()) << found.report.message;
      const bool hangs = found.state.positions(2, 1) < -kTrussRise;
      EXPECT_EQ(found.report.snaps.size(), hangs ? 1U : 0U) << share;
      EXPECT_TRUE(hangs || share < 1);
      EXPECT_FALSE(hangs && share == 0.5);
    }
  }
}

TEST(Snaps, AColumnThatTurnsOverUnderAPushIsASnap) {
  for (const double load : {1.5, 3.0}) {
    BeamModel model = column_model({ColumnEnds::kPinnedPinned, 8, load});
    const BeamSolution plain = solved(model);
    model.temporary_loads = {{4, {1e-3, 0, 1e-3}}};
    const BeamSolution pushed = solved(model);
    ASSERT_TRUE(pushed.report.converged()) << pushed.report.message;
    EXPECT_EQ(pushed.report.snaps.empty(), plain.report.snaps.empty())
        << load << ": " << pushed.report.message;
  }
}

TEST(Snaps, ATrussBesideASlackCableStillSnaps) {
  const double limit = truss_limit_load();
  BeamModel model = truss(2 * limit);
  const BeamModel cable = slack_cable(300);
  const int nodes = static_cast<int>(model.nodes.size());
  for (const BeamNode& node : cable.nodes)
    model.nodes.push_back({node.position + Eigen::Vector3d(0, 5, 0)});
  model.sections.push_back(cable.sections[0]);
  for (BeamElement element : cable.elements) {
    element.start += nodes;
    element.finish += nodes;
    element.section = 1;
    model.elements.push_back(element);
  }
  for (BeamSupport support : cable.supports) {
    support.node += nodes;
    model.supports.push_back(support);
  }
  model.loads.push_back({nodes + 1, cable.loads[0].force});
  for (const Variant& variant : watched()) {
    const BeamSolution found = solved(model, variant.options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    ASSERT_EQ(found.report.snaps.size(), 1U) << variant.name;
    EXPECT_NEAR(found.report.snaps[0].load_factor, 0.5, place_error(variant.options));
  }
}

TEST(Snaps, AnArchThroughItsLimitPointIsASnap) {
  for (const Variant& variant : watched()) {
    const BeamSolution found = solved(shallow_arch(25), variant.options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    EXPECT_LT(found.state.positions(2, 8), -0.03);
    EXPECT_EQ(found.report.snaps.size(), 1U) << variant.name;
  }
}

/// At three times Euler's load the head of a pinned column may pass its foot: the column hangs.
TEST(Snaps, AColumnThatTurnsOverIsASnap) {
  int turned_over = 0;
  for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kNewton}) {
    for (const int elements : {4, 8, 16}) {
      for (const double load : {3.0, 4.0}) {
        const Column column{ColumnEnds::kPinnedPinned, elements, load};
        const BeamSolution found = solved(column_model(column), method);
        if (!found.report.converged() || found.state.positions(2, elements) > 0) continue;
        ++turned_over;
        SCOPED_TRACE(found.report.message);
        ASSERT_FALSE(found.report.snaps.empty())
            << to_string(method) << ", " << elements << " elements at " << load;
        EXPECT_GT(found.report.snaps.back().load_factor, 0);
        EXPECT_LE(found.report.snaps.back().load_factor, 1);
        EXPECT_GT(found.report.snaps.back().turn, 1);
      }
    }
  }
  EXPECT_GT(turned_over, 0);
}

struct Reversal {
  BeamStructure structure;
  BeamState from, to;

  /// From `from` under its loads, at share 0, to `to`.
  [[nodiscard]] bool is_found() const {
    const JobContext context;
    detail::NewtonSolver newton(structure, context);
    const detail::LoadPath path = detail::LoadPath::following(structure, from, {});
    return detail::reverses(structure, path, newton, {from, 0}, {to, 1});
  }
};

/// A member of the family of arches, raised to a side that a temporary load chooses.
BeamState raised_rod(double push, const Eigen::Vector3d& side) {
  BeamModel model = round_rod(push);
  model.temporary_loads = {{6, 0.1 * side}};
  const BeamSolution found = solved(model);
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_TRUE(found.report.snaps.empty());
  return found.state;
}

TEST(Snaps, ArchesOfARoundRodAreEqualInAnyPlane) {
  const BeamState first = raised_rod(0.05, {0, 0, 1});
  for (const Eigen::Vector3d& side :
       {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 1, 0.3), Eigen::Vector3d(0, 0.8, -0.6)})
    EXPECT_TRUE((Reversal{BeamStructure(round_rod(0.1)), first, raised_rod(0.1, side)}.is_found()));
}

/// Its elements have the energies of the standing one, but tension in place of compression.
TEST(Snaps, AHangingColumnDoesNotStandUpAgain) {
  const BeamModel below = column_model({ColumnEnds::kPinnedPinned, 8, 0.5});
  const BeamModel beyond = column_model({ColumnEnds::kPinnedPinned, 8, 0.6});
  const BeamState standing = solved(below).state;
  BeamState hanging = BeamStructure(beyond).rest_state();
  hanging.positions.row(2) *= -1;
  for (Eigen::Quaterniond& rotation : hanging.rotations)
    rotation = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
  EXPECT_FALSE((Reversal{BeamStructure(beyond), standing, hanging}.is_found()));
}

/// Unstrained, both are stable.
TEST(Snaps, AnUnloadedTrussIsNotItsMirrorImage) {
  const BeamState drawn = BeamStructure(truss(0)).rest_state();
  const BeamModel loaded = truss(2 * truss_limit_load());
  EXPECT_FALSE((Reversal{BeamStructure(loaded), drawn, solved(loaded).state}.is_found()));
}

}  // namespace
}  // namespace limber::beams::snaps_test
