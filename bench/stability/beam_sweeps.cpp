// Beams with known answers, by both methods and by the chosen one.

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/stability/beam_checks.h"
#include "bench/stability/elastica.h"
#include "bench/stability/sweep.h"
#include "engine/base/rotations/logarithm.h"
#include "engine/beams/structure/elastic.h"
#include "tests/support/beam_problems.h"

namespace limber::bench::stability {
namespace {

using beams::BeamMethod;
using beams::BeamModel;
using beams::BeamSolution;
using beams::BeamStructure;
using Eigen::Vector3d;
using testing::cantilever_model;
using testing::clamped;
using testing::straight_beam;

constexpr double kAllowedPlace = 1e-3;  // of lengths: elements are as many as it takes
constexpr double kTurn = 2 * std::numbers::pi;

BeamSolution solve(const BeamModel& model, BeamMethod method) {
  beams::BeamSolveOptions options;
  options.method = method;
  return find_equilibrium(BeamStructure(model), options);
}

/// Distance of the last node from where it must be, over the length.
Finding with_tip(const BeamSolution& found, const Vector3d& tip, double length = 1) {
  Finding finding = finding_of(found);
  finding.error = (found.state.positions.rightCols<1>() / length - tip).norm();
  finding.allowed = kAllowedPlace;
  return finding;
}

Vector3d tip_of(const ElasticaTip& tip) { return {tip.along, 0, tip.deflection}; }

Finding with_load(double alpha, BeamMethod method) {
  const int elements = std::clamp(static_cast<int>(5 * std::sqrt(alpha)), 16, 400);
  return with_tip(solve(cantilever_model(elements, alpha, 1, 1e4), method),
                  tip_of(cantilever_tip(alpha)));
}

/// Thick beams stretch: P / EA adds up to alpha / slenderness^2 to the elastica.
Finding with_slenderness(double slenderness, BeamMethod method) {
  Finding finding =
      with_tip(solve(cantilever_model(16, 1, 1, slenderness), method), tip_of(cantilever_tip(1)));
  finding.allowed += 1 / (slenderness * slenderness);
  return finding;
}

/// A steel strip of this length: its load is a multiple of EI / L^2.
Finding of_length(double length, BeamMethod method) {
  BeamModel model = cantilever_model(16, 1);
  beams::BeamMaterial steel;
  steel.young = 2.1e11;
  steel.poisson = 0.3;
  steel.density = 7850;
  model.sections = {make_section(beams::rectangle(length / 50, length / 100), steel)};
  for (beams::BeamNode& node : model.nodes) node.position *= length;
  model.loads[0].force.z() = model.sections[0].bending_2 / (length * length);
  Finding finding = with_tip(solve(model, method), tip_of(cantilever_tip(1)), length);
  finding.allowed += 1e-4;  // EI over EA L^2
  return finding;
}

Finding with_stiffness(double factor, BeamMethod method) {
  BeamModel model = cantilever_model(16, 1);
  beams::BeamSection& section = model.sections[0];
  for (double* value :
       {&section.stretching, &section.torsion, &section.bending_2, &section.bending_3})
    *value *= factor;
  model.loads[0].force *= factor;
  return with_tip(solve(model, method), tip_of(cantilever_tip(1)));
}

/// One half of a cantilever stiffer than the other.
Finding with_contrast(double contrast, bool is_root_stiff, BeamMethod method) {
  BeamModel model = cantilever_model(16, 1);
  beams::BeamSection stiff = model.sections[0];
  for (double* value : {&stiff.stretching, &stiff.torsion, &stiff.bending_2, &stiff.bending_3})
    *value *= contrast;
  model.sections.push_back(stiff);
  for (std::size_t e = 0; e < 16; ++e)
    if ((e < 8) == is_root_stiff) model.elements[e].section = 1;
  const std::vector<double> bending =
      is_root_stiff ? std::vector<double>{contrast, 1} : std::vector<double>{1, contrast};
  return with_tip(solve(model, method), tip_of(uneven_cantilever_tip(bending, 1)));
}

/// One element among sixteen that is so short.
Finding with_a_short_element(double share, BeamMethod method) {
  BeamModel model = cantilever_model(16, 1);
  for (std::size_t i = 8; i < 16; ++i)
    model.nodes[i].position.x() =
        7.0 / 16 + share / 16 + (static_cast<double>(i) - 8) * (9 - share) / (16.0 * 8);
  return with_tip(solve(model, method), tip_of(cantilever_tip(1)));
}

/// The last node turned so many times about the axis of least bending, in the plane.
Finding rolled_up(double turns, BeamMethod method) {
  const int elements = 16 * std::max(1, static_cast<int>(std::ceil(turns)));
  BeamModel model = straight_beam(elements);
  model.supports.push_back(clamped(0));
  for (int i = 1; i <= elements; ++i)
    model.supports.push_back({i, {false, true, false, false, false, false}});
  beams::PrescribedMotion motion;
  motion.node = elements;
  motion.rotates = {true, true, true};
  motion.rotation = Vector3d(0, -kTurn * turns, 0);
  model.motions.push_back(motion);
  const double t = kTurn * turns;
  return with_tip(solve(model, method), {std::sin(t) / t, 0, (1 - std::cos(t)) / t});
}

Finding curved_at_rest(double turns, BeamMethod method) {
  const int elements = 16 * std::max(1, static_cast<int>(std::ceil(turns)));
  BeamModel model = straight_beam(elements);
  for (beams::BeamElement& e : model.elements) e.rest_curvature.y() = -kTurn * turns;
  model.supports.push_back(clamped(0));
  const double t = kTurn * turns;
  return with_tip(solve(model, method), {std::sin(t) / t, 0, (1 - std::cos(t)) / t});
}

/// Twisted by a moment about its axis.
Finding twisted(double angle) {
  BeamModel model = straight_beam(20);
  model.supports.push_back(clamped(0));
  beams::NodalLoad load;
  load.node = 20;
  load.moment = Vector3d(angle, 0, 0);
  model.loads.push_back(load);
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  Finding finding = with_tip(found, {1, 0, 0});
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, Vector3d::UnitX()));
  finding.error =
      std::max(finding.error,
               rotations::logarithm(expected.conjugate() * found.state.rotations.back()).norm());
  // The energy tells turns that the rotation does not.
  finding.error =
      std::max(finding.error, std::abs(found.report.elastic_energy / (0.5 * angle * angle) - 1));
  return finding;
}

/// The ends of a straight beam brought to another distance. Stretching is linear in the strain.
Finding stretched(double strain, BeamMethod method) {
  BeamModel model = straight_beam(8, 1, 100);
  model.supports.push_back(clamped(0));
  beams::PrescribedMotion motion;
  motion.node = 8;
  motion.translates = motion.rotates = {true, true, true};
  motion.translation = {strain, 0, 0};
  model.motions.push_back(motion);
  const BeamSolution found = solve(model, method);
  Finding finding = finding_of(found);
  const double energy = 0.5 * model.sections[0].stretching * strain * strain;
  finding.error = std::abs(found.report.elastic_energy / energy - 1);
  finding.allowed = 1e-6;
  return finding;
}

/// Nodes that prescribed motions bring to each other: no length is left of elements.
Finding squeezed(double rest, BeamMethod method) {
  BeamModel model = straight_beam(4);
  model.supports.push_back(clamped(0));
  beams::PrescribedMotion motion;
  motion.node = 1;
  motion.translates = motion.rotates = {true, true, true};
  motion.translation = {-0.25 + rest, 0, 0};
  model.motions.push_back(motion);
  const BeamSolution found = solve(model, method);
  Finding finding = finding_of(found);
  // Element 1 carries the energy of its strain; the others are as they were drawn.
  const double change = (rest - 0.25) / 0.25;
  finding.error = std::abs(found.report.elastic_energy /
                               (0.5 * model.sections[0].stretching * 0.25 * change * change) -
                           1);
  finding.allowed = 1e-6;
  return finding;
}

Finding with_rest_length(double length, BeamMethod method) {
  BeamModel model = straight_beam(4);
  model.supports.push_back(clamped(0));
  model.elements[1].rest_length = length;
  const BeamStructure structure(model);
  const BeamSolution found = solve(model, method);
  Finding finding = with_tip(found, {0.75 + length, 0, 0}, std::max(1.0, length));
  finding.error = (found.state.positions.rightCols<1>() - Vector3d(0.75 + length, 0, 0)).norm() /
                  std::max(1.0, length);
  return finding;
}

/// GJ of a beam whose end is turned by a moment that goes with it: next to a mechanism.
Finding soft_torsion(double torsion, BeamMethod method) {
  BeamModel model = straight_beam(8);
  model.sections[0].torsion = torsion;
  model.supports.push_back(clamped(0));
  for (int i = 1; i <= 8; ++i) model.supports.push_back({i, {true, true, true, false, true, true}});
  beams::NodalLoad load;
  load.node = 8;
  load.moment = Vector3d(0.7 * torsion, 0, 0);
  model.loads.push_back(load);
  const BeamSolution found = solve(model, method);
  Finding finding = finding_of(found);
  finding.error = std::abs(rotations::logarithm(found.state.rotations.back()).x() - 0.7);
  finding.allowed = kAllowedPlace;
  return finding;
}

Sweep beam_sweep(const std::string& name, const char* parameter, std::vector<double> values,
                 int required, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "beams";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "the equilibrium of a cantilever with a load at its tip";
  sweep.check = "the elastica, by elliptic integrals";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

void add_methods(Sweeps& sweeps, const Sweep& pattern,
                 const std::function<Finding(double, BeamMethod)>& run) {
  for (const BeamMethod method :
       {BeamMethod::kChoose, BeamMethod::kNewton, BeamMethod::kRelaxation}) {
    Sweep sweep = pattern;
    sweep.name += fmt::format(", {}", to_string(method));
    sweep.run = [=](double value) { return run(value, method); };
    // The project's claims hold for the user's default method.
    if (method != BeamMethod::kChoose) sweep.required = 0;
    sweeps.push_back(std::move(sweep));
  }
}

}  // namespace

Sweeps beam_sweeps() {
  const std::vector<double> lengths = {1,    1e-1, 1e1,  1e-2, 1e2,  1e-3, 1e3,
                                       1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9};
  const std::vector<double> factors = {1,   1e-3,  1e3,  1e-6,  1e6, 1e-9,
                                       1e9, 1e-12, 1e12, 1e-15, 1e15};
  const std::vector<double> turns = {0.25, 0.5, 0.75, 0.9, 0.99, 1 - 1e-6, 1, 1 + 1e-6, 1.5, 2, 3};
  Sweeps sweeps;
  add_methods(sweeps, beam_sweep("load", "P L^2 / EI", decades(-8, 5), 12, {}), with_load);
  add_methods(sweeps,
              beam_sweep("slenderness", "length over radius of gyration", decades(1, 9), 4, {}),
              with_slenderness);
  add_methods(sweeps, beam_sweep("size", "length of a steel strip [m]", lengths, 13, {}),
              of_length);
  add_methods(sweeps, beam_sweep("stiffness", "all stiffnesses and loads times", factors, 11, {}),
              with_stiffness);
  Sweep contrast = beam_sweep("stiff root", "contrast of EI and EA", decades(1, 12), 8, {});
  contrast.check = "the elastica of two pieces, by shooting";
  add_methods(sweeps, contrast,
              [](double value, BeamMethod method) { return with_contrast(value, true, method); });
  contrast.name = "stiff tip";
  add_methods(sweeps, contrast,
              [](double value, BeamMethod method) { return with_contrast(value, false, method); });
  add_methods(
      sweeps,
      beam_sweep("one short element", "length over that of others", decades(0, -10, -1), 7, {}),
      with_a_short_element);
  Sweep roll = beam_sweep("roll-up by a prescribed rotation", "turns", turns, 7, {});
  roll.asked = "a straight beam whose end is turned";
  roll.check = "the circle";
  add_methods(sweeps, roll, rolled_up);
  roll.name = "curvature at rest";
  roll.asked = "a beam that is drawn straight and curved at rest";
  add_methods(sweeps, roll, curved_at_rest);
  Sweep twist = beam_sweep("twist by a moment", "M L / GJ [rad]",
                           {0.1, 1, 3, 3.14, 3.15, 6.28, 10, 100, 1e3}, 3, twisted);
  twist.asked = "a straight beam twisted by a moment that keeps its direction";
  twist.check = "angle and energy of pure torsion";
  sweeps.push_back(twist);
  Sweep stretch = beam_sweep("ends pulled apart", "strain", decades(-8, 3), 7, {});
  stretch.asked = "a straight beam whose ends are moved apart";
  stretch.check = "the energy of stretching alone";
  add_methods(sweeps, stretch, stretched);
  stretch.name = "an element pressed to no length";
  stretch.parameter = "what is left of its length";
  stretch.values = {0.2, 1e-1, 1e-2, 1e-4, 1e-8, 0};
  stretch.required = 0;
  add_methods(sweeps, stretch, squeezed);
  Sweep rest = beam_sweep("length at rest", "of one of four elements [drawn structure]",
                          {1, 10, 100, 1e4, 1e8, 1e90, 0.1, 1e-2, 1e-4, 1e-8, 1e-30}, 0, {});
  rest.asked = "a free end whose beam grows";
  rest.check = "where the end is then";
  add_methods(sweeps, rest, with_rest_length);
  Sweep soft = beam_sweep("next to a mechanism", "GJ over EI", decades(0, -16, -2), 5, {});
  soft.asked = "a beam that can turn about itself, under a moment";
  soft.check = "the angle of torsion";
  add_methods(sweeps, soft, soft_torsion);
  return sweeps;
}

}  // namespace limber::bench::stability
