// Structures at random: what is reported as a minimum is one by second derivatives that differences
// of forces give, and the negative eigenvalues that are reported are there.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <string>

#include "tests/support/dense.h"

#include "engine/base/random.h"
#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;
using limber::testing::clamped;

double between(Random& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

Vector3d direction(Random& random) {
  return Vector3d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5)
      .normalized();
}

int add_node(BeamModel& model, const Vector3d& position) {
  model.nodes.push_back({position, Vector3d(0.31, 0.17, 0.93)});
  return static_cast<int>(model.nodes.size()) - 1;
}

/// Straight, of a few elements. @returns its last node
int add_bar(BeamModel& model, Random& random, int from, const Vector3d& to, int section) {
  const int elements = 2 + static_cast<int>(3 * random.uniform());
  const Vector3d start = model.nodes[static_cast<std::size_t>(from)].position;
  for (int i = 1; i <= elements; ++i) {
    BeamElement e;
    e.start = from;
    e.finish = add_node(model, start + (to - start) * i / elements);
    e.section = section;
    from = e.finish;
    model.elements.push_back(e);
  }
  return from;
}

/// One to three parts that hang together or do not, of stiffnesses up to ten thousand times apart;
/// bars end to end, pressed or pulled along themselves or anywhere, here and there a second
/// support.
BeamModel random_model(std::uint64_t seed) {
  Random random(seed);
  BeamModel model;
  const int parts = 1 + static_cast<int>(3 * random.uniform());
  int last = -1;
  for (int part = 0; part < parts; ++part) {
    const double bending = std::pow(10, between(random, -4, 0));
    const double ratio = between(random, 1.2, 5);
    const int section = static_cast<int>(model.sections.size());
    model.sections.push_back(
        {bending * 1e5, bending * between(random, 0.3, 1.5), bending, bending * ratio});
    const bool hangs_on = last >= 0 && random.uniform() < 0.4;
    int from = hangs_on ? last : add_node(model, Vector3d(3.0 * part, 0, 0));
    if (!hangs_on) model.supports.push_back(clamped(from));
    const int bars = 1 + static_cast<int>(2 * random.uniform());
    Vector3d along = direction(random);
    double length = 1;
    for (int bar = 0; bar < bars; ++bar) {
      along = direction(random);
      length = between(random, 0.5, 1.5);
      const Vector3d start = model.nodes[static_cast<std::size_t>(from)].position;
      from = add_bar(model, random, from, start + length * along, section);
    }
    if (random.uniform() < 0.3) {
      BeamSupport support{from, {true, true, false, false, false, false}};
      support.axes = reference::rotation_between(Vector3d::UnitZ(), along).toRotationMatrix();
      model.supports.push_back(support);
    }
    // Along the last bar it stays straight, in any direction.
    const double size = between(random, -2, 12) * bending / (length * length);
    const bool is_along = random.uniform() < 0.6;
    model.loads.push_back({from, -size * (is_along ? along : direction(random))});
    last = from;
  }
  return model;
}

class BeamRandomStability : public ::testing::TestWithParam<BeamMethod> {};

TEST_P(BeamRandomStability, TheReportedInertiaHoldsByDifferences) {
  int converged = 0, unstable = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const BeamStructure structure(random_model(seed));
    BeamSolveOptions options;
    options.method = GetParam();
    const BeamSolution found = find_equilibrium(structure, options);
    const BeamReport& report = found.report;
    if (report.converged()) {
      ++converged;
      EXPECT_EQ(report.negative_eigenvalues, 0) << "seed " << seed;
    }
    if (!report.negative_eigenvalues || report.status == BeamStatus::kMechanism) continue;
    EXPECT_EQ(limber::testing::negative_by_differences(structure, found.state),
              *report.negative_eigenvalues)
        << "seed " << seed << ": " << report.message;
    unstable += *report.negative_eigenvalues > 0 ? 1 : 0;
  }
  // The test would say nothing if nothing was found.
  EXPECT_GT(converged, 8);
  if (GetParam() == BeamMethod::kRelaxation) {
    EXPECT_GT(unstable, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BeamRandomStability,
                         ::testing::Values(BeamMethod::kChoose, BeamMethod::kNewton,
                                           BeamMethod::kRelaxation),
                         [](const auto& test) -> std::string {
                           if (test.param == BeamMethod::kChoose) return "Chosen";
                           return test.param == BeamMethod::kNewton ? "Newton" : "Relaxation";
                         });

}  // namespace
}  // namespace limber::beams
