// Forces, moments and utilisation of loads within the span of an element, against textbooks.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "engine/beams/refinement/member_results.h"
#include "engine/beams/results/beam_results.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;
using limber::testing::clamped;
using limber::testing::straight_beam;

enum Component { kAxial, kTorque, kShear2, kShear3, kMoment2, kMoment3 };

struct Solved {
  BeamStructure structure;
  BeamState state;
  BeamResults results;
};

Solved solved(const BeamModel& model, BeamMethod method = BeamMethod::kChoose) {
  BeamStructure structure(model);
  BeamSolveOptions options;
  options.method = method;
  options.relaxation_tolerance = 1e-9;
  const BeamSolution found = find_equilibrium(structure, options);
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  BeamResults results = results_of(structure, found.state);
  return {std::move(structure), found.state, std::move(results)};
}

/// Even load down (along -z) on each element: EI = 1, and a deflection that is small.
BeamModel evenly_loaded(int elements, double q, double length = 1) {
  BeamModel model = straight_beam(elements, length, 1e3);
  for (int e = 0; e < elements; ++e) model.distributed_loads.push_back({e, {0, 0, -q}});
  return model;
}

constexpr double kLoad = 1e-3;
constexpr double kSmall = 1e-4;  // relative: what stretching and turning add

const BeamSupport kPin{0, {true, true, true, true, false, true}};
/// Free along x: one element between two clamps has no unknown.
BeamSupport clamped_but_along_x(int node) { return {node, {false, true, true, true, true, true}}; }
BeamSupport roller(int node) { return {node, {false, true, true, false, false, false}}; }

double largest_size(const Solved& of, int element, Component component) {
  return std::abs(of.results.extremes[static_cast<std::size_t>(element)][component].peak());
}

TEST(SpanLoads, SimplySupportedJoistOfOneElement) {
  BeamModel model;
  model.nodes = {{Vector3d(0, 0, 0)}, {Vector3d(6, 0, 0)}};
  model.sections = {make_section(rectangle(0.1, 0.3), {11e9, 0.3, 0, 24e6})};
  model.elements.resize(1);
  model.elements[0].finish = 1;
  model.supports = {{0, {true, true, true, true, false, false}},
                    {1, {false, true, true, false, false, false}}};
  model.distributed_loads.push_back({0, {0, 0, -5000}});
  const Solved joist = solved(model);
  EXPECT_NEAR(largest_size(joist, 0, kMoment2), 22500, 25);
  EXPECT_NEAR(joist.results.largest_utilisation, 0.625, 1e-3);
  EXPECT_NEAR(joist.results.governing_places[0], 0.5, 1e-3);
  EXPECT_NEAR(largest_size(joist, 0, kShear3), 15000, 15);
  EXPECT_NEAR(joist.results.forces[0].start_moment_2, 0, 1);
}

TEST(SpanLoads, ClampedBeamOfAnyNumberOfElements) {
  for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kRelaxation}) {
    for (const int elements : {1, 2, 4, 16}) {
      BeamModel model = evenly_loaded(elements, kLoad);
      model.supports = {clamped(0), clamped_but_along_x(elements)};
      const Solved beam = solved(model, method);
      const std::string what =
          std::string(to_string(method)) + ", " + std::to_string(elements) + " elements";
      const Subdivision whole(model, std::vector<int>(static_cast<std::size_t>(elements), 1));
      EXPECT_NEAR(std::abs(beam.results.forces.front().start_moment_2), kLoad / 12, kSmall * kLoad)
          << what;
      EXPECT_NEAR(std::abs(beam.results.forces.back().finish_moment_2), kLoad / 12, kSmall * kLoad)
          << what;
      const int middle = elements / 2;
      const double inside = beam.results.distributions.at(middle, elements == 1 ? 0.5 : 0).moment_2;
      EXPECT_NEAR(std::abs(inside), kLoad / 24, kSmall * kLoad) << what;
      EXPECT_LT(inside * beam.results.forces.front().start_moment_2, 0) << what;
      EXPECT_NEAR(beam.results.reaction_forces(2, 0), kLoad / 2, kSmall * kLoad) << what;
      EXPECT_NEAR(std::abs(beam.results.reaction_moments(1, 0)), kLoad / 12, kSmall * kLoad)
          << what;
      if (elements > 1) {
        EXPECT_NEAR(-beam.state.positions(2, middle), kLoad / 384, 1e-3 * kLoad / 384) << what;
      }
    }
  }
}

TEST(SpanLoads, ProppedCantileverHasItsLargestMomentWithinTheSpan) {
  for (const bool by_hinge : {false, true}) {
    for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kRelaxation}) {
      BeamModel model = evenly_loaded(1, kLoad);
      model.supports = {clamped(0), by_hinge ? clamped(1) : roller(1)};
      if (by_hinge) {
        model.supports[1].fixed[0] = false;
        model.elements[0].finish_release.rotations = {false, true, false};
      }
      const Solved beam = solved(model, method);
      const Extremes& moment = beam.results.extremes[0][kMoment2];
      const double clamp = beam.results.forces[0].start_moment_2;
      EXPECT_NEAR(std::abs(clamp), kLoad / 8, kSmall * kLoad) << by_hinge;
      EXPECT_NEAR(beam.results.forces[0].finish_moment_2, 0, kSmall * kLoad) << by_hinge;
      const bool sags_up = clamp < 0;
      EXPECT_NEAR(std::abs(sags_up ? moment.largest : moment.least), 9 * kLoad / 128,
                  kSmall * kLoad)
          << by_hinge;
      EXPECT_NEAR(sags_up ? moment.largest_place : moment.least_place, 5.0 / 8, 1e-3) << by_hinge;
      EXPECT_NEAR(beam.results.reaction_forces(2, 0), 5 * kLoad / 8, kSmall * kLoad) << by_hinge;
    }
  }
}

/// Of an element that releases its shear at the finish: clamped and guided.
TEST(SpanLoads, AGuidedEndPassesNoShear) {
  BeamModel model = evenly_loaded(1, kLoad);
  model.elements[0].finish_release.forces = {false, false, true};
  model.supports = {clamped(0), clamped_but_along_x(1)};
  const Solved beam = solved(model);
  EXPECT_NEAR(std::abs(beam.results.forces[0].start_moment_2), kLoad / 3, kSmall * kLoad);
  EXPECT_NEAR(std::abs(beam.results.forces[0].finish_moment_2), kLoad / 6, kSmall * kLoad);
  EXPECT_NEAR(beam.results.distributions.at(0, 1).shear_3, 0, kSmall * kLoad);
  EXPECT_NEAR(beam.results.reaction_forces(2, 0), kLoad, kSmall * kLoad);
  EXPECT_NEAR(beam.results.reaction_forces(2, 1), 0, kSmall * kLoad);
}

/// Slope deflection: the corner turns by (q L^2 / 12) / (2 EI_b / L + 4 EI_c / H).
TEST(SpanLoads, PortalOfOneElementAMember) {
  const double length = 2, height = 1.5, q = 1e-3;
  BeamModel model;
  model.nodes = {{Vector3d(0, 0, 0)},
                 {Vector3d(0, 0, height)},
                 {Vector3d(length, 0, height)},
                 {Vector3d(length, 0, 0)}};
  model.sections = {{1e7, 1, 1, 1}, {1e7, 1, 3, 3}};
  for (int i = 0; i < 3; ++i) {
    BeamElement e;
    e.start = i;
    e.finish = i + 1;
    e.section = i == 1 ? 1 : 0;
    e.normal = i == 1 ? Vector3d(0, 0, 1) : Vector3d(1, 0, 0);
    model.elements.push_back(e);
  }
  model.supports = {clamped(0), clamped(3)};
  for (const int node : {1, 2})
    model.supports.push_back({node, {false, true, false, true, false, true}});
  model.distributed_loads.push_back({1, {0, 0, -q}});
  const Solved portal = solved(model);
  const double turn = q * length * length / 12 / (2 * 3 / length + 4 / height);
  const double corner = 4 * turn / height;
  const auto& forces = portal.results.forces;
  EXPECT_NEAR(std::abs(forces[0].finish_moment_2), corner, 1e-3 * corner);
  EXPECT_NEAR(std::abs(forces[0].start_moment_2), corner / 2, 1e-3 * corner);
  EXPECT_NEAR(std::abs(forces[1].start_moment_2), corner, 1e-3 * corner);
  EXPECT_NEAR(std::abs(portal.results.distributions.at(1, 0.5).moment_2),
              q * length * length / 8 - corner, 1e-3 * corner);
  EXPECT_NEAR(forces[0].axial, -q * length / 2, 1e-3 * q * length);
}

TEST(SpanLoads, InclinedBeamUnderItsWeight) {
  const double slope = std::numbers::pi / 6, weight = 1e-3;
  BeamModel model = straight_beam(1, 1, 1e3);
  model.nodes[1].position = Vector3d(std::cos(slope), 0, std::sin(slope));
  model.sections[0].mass_per_length = weight;
  model.gravity = Vector3d(0, 0, -1);
  model.supports = {kPin, roller(1)};
  const Solved beam = solved(model);
  EXPECT_NEAR(largest_size(beam, 0, kMoment2), weight * std::cos(slope) / 8, kSmall * weight);
  // Both reactions are half of the weight, upwards.
  const double along = 0.5 * weight * std::sin(slope);
  EXPECT_NEAR(beam.results.extremes[0][kAxial].least, -along, kSmall * weight);
  EXPECT_NEAR(beam.results.extremes[0][kAxial].least_place, 0, 1e-6);
  EXPECT_NEAR(beam.results.extremes[0][kAxial].largest, along, kSmall * weight);
  EXPECT_NEAR(beam.results.distributions.at(0, 0.25).shear_3, -0.25 * weight * std::cos(slope),
              kSmall * weight);
}

TEST(SpanLoads, ColumnUnderItsOwnWeightStandsOnAllOfIt) {
  for (const int elements : {1, 3}) {
    BeamModel model = straight_beam(elements);
    for (int i = 0; i <= elements; ++i)
      model.nodes[static_cast<std::size_t>(i)] = {Vector3d(0, 0, static_cast<double>(i) / elements),
                                                  Vector3d::UnitX()};
    model.sections[0].mass_per_length = 2;
    model.gravity = Vector3d(0, 0, -1);
    model.supports = {clamped(0)};
    const Solved column = solved(model);
    EXPECT_NEAR(column.results.forces[0].axial, -2, 1e-6);
    EXPECT_NEAR(column.results.distributions.at(0, 0).axial, -2, 1e-6);
    EXPECT_NEAR(column.results.distributions.at(elements - 1, 1).axial, 0, 1e-6);
    EXPECT_NEAR(column.results.distributions.at(0, 0.5).axial, -2 + 1.0 / elements, 1e-6);
  }
}

TEST(SpanLoads, ElementThatReleasesItsAxialForceHangsFromItsOtherEnd) {
  BeamModel model = straight_beam(1);
  model.nodes[1] = {Vector3d(0, 0, 1)};
  model.nodes[0].normal = model.nodes[1].normal = Vector3d::UnitX();
  model.sections[0].mass_per_length = 2;
  model.gravity = Vector3d(0, 0, -1);
  model.elements[0].start_release.forces = {true, false, false};
  model.supports = {clamped(0), {1, {true, true, true, true, true, false}}};
  const Solved hanger = solved(model);
  EXPECT_NEAR(hanger.results.distributions.at(0, 1).axial, 2, 1e-9);
  EXPECT_NEAR(hanger.results.distributions.at(0, 0).axial, 0, 1e-9);
  EXPECT_NEAR(hanger.results.reaction_forces(2, 1), 2, 1e-9);
}

/// Tension of a heavy cable is the force at each of its places; it has no moments.
TEST(SpanLoads, CablesCarryTheirWeightByTension) {
  BeamModel model = straight_beam(1);
  model.elements[0].kind = BeamKind::kCable;
  model.nodes[1].position = Vector3d(0, 0, -1);
  model.sections[0].mass_per_length = 3;
  model.gravity = Vector3d(0, 0, -1);
  model.supports = {{0, {true, true, true, false, false, false}},
                    {1, {true, true, false, false, false, false}}};
  const Solved cable = solved(model);
  EXPECT_NEAR(cable.results.distributions.at(0, 0).axial, 3, 1e-9);
  EXPECT_NEAR(cable.results.distributions.at(0, 1).axial, 0, 1e-9);
  EXPECT_EQ(largest_size(cable, 0, kMoment2), 0);
}

BeamModel loaded_cantilever(int elements, double q, LoadDirection direction) {
  BeamModel model = straight_beam(elements, 1, 1e3);
  for (int e = 0; e < elements; ++e) model.distributed_loads.push_back({e, {0, 0, q}, direction});
  model.supports.push_back(clamped(0));
  for (int i = 1; i <= elements; ++i)
    model.supports.push_back({i, {false, true, false, true, false, true}});
  return model;
}

/// Errors fall with the fourth power of the elements' length where the load is spread over them.
TEST(SpanLoads, LargeDeflectionsConvergeWithTheFourthOrder) {
  for (const LoadDirection direction : {LoadDirection::kFixed, LoadDirection::kFollowing}) {
    const double q = 8;  // the tip goes up by 0.7
    const auto tip = [&](int elements) -> Vector3d {
      return solved(loaded_cantilever(elements, q, direction)).state.positions.col(elements);
    };
    const auto clamp_moment = [&](int elements) {
      return solved(loaded_cantilever(elements, q, direction)).results.forces[0].start_moment_2;
    };
    const Vector3d limit = tip(64);
    EXPECT_GT(limit.z(), 0.5);
    const double coarse = (tip(4) - limit).norm(), fine = (tip(8) - limit).norm();
    EXPECT_LT(fine, 1e-3);
    EXPECT_GT(std::log2(coarse / fine), 3.5) << coarse << " " << fine;
    const double moment = clamp_moment(64);
    EXPECT_NEAR(clamp_moment(4), moment, 5e-3 * std::abs(moment));
    EXPECT_NEAR(clamp_moment(8), moment, 5e-4 * std::abs(moment));
  }
}

/// By every method, where the load turns with the element and its node with something else.
TEST(SpanLoads, FollowingLoadOnAHingedElementTurnsWithIt) {
  for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kRelaxation}) {
    BeamModel model = straight_beam(1);
    model.elements[0].start_release.rotations = {false, true, false};
    model.supports = {clamped(0), {1, {false, true, false, true, false, true}}};
    model.motions.push_back({1, {true, false, true}, {std::cos(1.0) - 1, 0, std::sin(1.0)}});
    model.distributed_loads.push_back({0, {0, 0, 1e-3}, LoadDirection::kFollowing});
    const Solved turned = solved(model, method);
    const Vector3d across(-std::sin(1.0), 0, std::cos(1.0));
    const Vector3d sum =
        turned.results.reaction_forces.col(0) + turned.results.reaction_forces.col(1);
    EXPECT_LT((sum + 1e-3 * across).norm(), 1e-6) << to_string(method);
    EXPECT_NEAR(largest_size(turned, 0, kMoment2), 1e-3 / 8, 1e-7) << to_string(method);
  }
}

/// A stretched bar with a load across: amplified by 1 / (1 - N / N_E) to first order.
TEST(SpanLoads, AxialForceChangesTheMomentWithinOneElement) {
  for (const double axial : {0.25, -0.25}) {
    BeamModel model = evenly_loaded(1, kLoad);
    model.supports = {kPin, roller(1)};
    model.loads.push_back({1, {axial, 0, 0}});
    const Solved beam = solved(model);
    // q / k^2 (sec(k / 2) - 1) of compression, (1 - sech(k / 2)) of tension; k^2 = |N| / EI.
    const double exact =
        kLoad / 0.25 * (axial > 0 ? 1 - 1 / std::cosh(0.25) : 1 / std::cos(0.25) - 1);
    EXPECT_NEAR(largest_size(beam, 0, kMoment2), exact, 3e-4 * exact) << axial;
    EXPECT_GT(std::abs(exact - kLoad / 8), 0.02 * exact) << "the load alone";
  }
}

TEST(SpanLoads, MembersThatAreCutHaveTheExtremesOfTheirParts) {
  BeamModel model = evenly_loaded(1, kLoad);
  model.supports = {clamped(0), roller(1)};
  const Subdivision cut(model, {5});
  const Solved parts = solved(cut_model(model, cut));
  const BeamResults member = member_results(parts.results, cut);
  ASSERT_EQ(member.extremes.size(), 1U);
  const Extremes& moment = member.extremes[0][kMoment2];
  const double inside = std::min(-moment.least, moment.largest);
  EXPECT_NEAR(inside, 9 * kLoad / 128, kSmall * kLoad);
  const double place = -moment.least < moment.largest ? moment.least_place : moment.largest_place;
  EXPECT_NEAR(place, 5.0 / 8, 1e-3);
  EXPECT_NEAR(std::abs(member.distributions.at(0, 5.0 / 8).moment_2), inside, kSmall * kLoad);
}

TEST(SectionStresses, OfATubeDoNotDependOnTheNormal) {
  const double radius = 0.03, moment = 1000;
  BeamModel model;
  model.nodes = {{Vector3d(0, 0, 0)}, {Vector3d(1, 0, 0)}};
  model.sections = {make_section(tube(radius, 0.025), {210e9, 0.3, 0, 200e6})};
  model.elements.resize(1);
  model.elements[0].finish = 1;
  model.supports = {clamped(0)};
  model.loads.push_back({1, Vector3d(0, 1, 1) * moment / std::sqrt(2.0)});
  const double inertia = 0.25 * std::numbers::pi * (std::pow(radius, 4) - std::pow(0.025, 4));
  const double expected = moment * radius / inertia;
  for (const double turn : {0.0, 0.3, 0.785, 1.2}) {
    model.elements[0].normal = Vector3d(0, std::sin(turn), std::cos(turn));
    const Solved arm = solved(model);
    EXPECT_NEAR(arm.results.stresses[0].bending, expected, 2e-3 * expected) << turn;
    EXPECT_NEAR(arm.results.largest_utilisation, expected / 200e6, 2e-3 * expected / 200e6) << turn;
  }
}

TEST(SectionStresses, OfARectangleAddUpInACorner) {
  const BeamSection section = make_section(rectangle(0.1, 0.2), {1e9, 0.3, 0, 1e6});
  SectionForces forces;
  forces.moment_2 = 300;
  forces.moment_3 = -200;
  forces.axial = -5000;
  const ElementStresses stresses = stresses_of(section, forces);
  const double bending = 300 / (0.1 * 0.04 / 6) + 200 / (0.2 * 0.01 / 6);
  EXPECT_NEAR(stresses.bending, bending, 1e-9 * bending);
  EXPECT_NEAR(stresses.axial, -5000 / 0.02, 1e-6);
  EXPECT_NEAR(stresses.utilisation, (bending + 5000 / 0.02) / 1e6, 1e-9);
}

}  // namespace
}  // namespace limber::beams
