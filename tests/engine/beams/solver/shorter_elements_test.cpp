// Elements too long to show how they buckle: what the reports say of them.

#include "engine/beams/solver/shorter_elements.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::clamped;
using limber::testing::Column;
using limber::testing::column_model;
using limber::testing::ColumnEnds;
using limber::testing::straight_beam;

/// Stable, without a word of doubt.
void expect_stable(const BeamSolution& found) {
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_EQ(found.report.negative_eigenvalues, 0) << found.report.message;
  EXPECT_TRUE(found.report.unjudged_elements.empty()) << found.report.message;
}

/// Its elements call it stable, shorter ones do not.
void expect_doubted(const BeamSolution& found, int element) {
  EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << found.report.message;
  EXPECT_FALSE(found.report.negative_eigenvalues.has_value());
  EXPECT_TRUE(found.report.is_unresolved);
  ASSERT_FALSE(found.report.unjudged_elements.empty()) << found.report.message;
  EXPECT_EQ(found.report.unjudged_elements[0], element);
  EXPECT_NE(found.report.message.find("element " + std::to_string(element)), std::string::npos)
      << found.report.message;
  EXPECT_NE(found.report.message.find("take shorter ones"), std::string::npos)
      << found.report.message;
}

TEST(BeamFinerJudgement, ColumnsOfOneElementAreStableUpToEulersLoad) {
  for (const ColumnEnds ends :
       {ColumnEnds::kPinnedPinned, ColumnEnds::kClampedFree, ColumnEnds::kClampedPinned,
        ColumnEnds::kClampedGuided, ColumnEnds::kClampedClamped}) {
    SCOPED_TRACE(to_string(ends));
    expect_stable(find_equilibrium(BeamStructure(column_model({ends, 1, 0.97}))));
    const Column above{ends, 1, ends == ColumnEnds::kClampedFree ? 1.004 : 1.03};
    const BeamSolution found = find_equilibrium(BeamStructure(column_model(above)));
    // One element shows how a guided column sways.
    if (limber::testing::deflection(above, found.state) > 0.1)
      expect_stable(found);
    else
      expect_doubted(found, 0);
  }
}

/// 1.3 times what buckles it, where one element buckles at 1.49 times that.
TEST(BeamFinerJudgement, AColumnOfOneElementClampedAndPinned) {
  for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kNewton, BeamMethod::kRelaxation,
                                  BeamMethod::kRelaxationThenNewton}) {
    BeamSolveOptions options;
    options.method = method;
    expect_doubted(find_equilibrium(
                       BeamStructure(column_model({ColumnEnds::kClampedPinned, 1, 1.3})), options),
                   0);
  }
}

/// A column clamped at its foot, its head rigidly on a beam of the same stiffness and length, whose
/// far end slides along the beam alone: it carries no tie force. Held against sway.
BeamModel braced_frame(int elements_of_column, double load) {
  BeamModel model = straight_beam(1, 1, 2e4);  // so stiff that the beam is not bent by shortening
  model.nodes.clear();
  model.elements.clear();
  for (int i = 0; i <= elements_of_column; ++i)
    model.nodes.push_back({Eigen::Vector3d(0, 0, static_cast<double>(i) / elements_of_column),
                           Eigen::Vector3d::UnitY()});
  model.nodes.push_back({Eigen::Vector3d(1, 0, 1), Eigen::Vector3d::UnitY()});
  for (int i = 0; i <= elements_of_column; ++i) {
    BeamElement e;
    e.start = i;
    e.finish = i + 1;
    model.elements.push_back(e);
  }
  constexpr bool x = true, o = false;
  model.supports = {clamped(0),
                    {elements_of_column + 1, {o, x, x, x, x, x}},
                    {elements_of_column, {x, x, o, x, o, x}}};
  for (int i = 1; i < elements_of_column; ++i) model.supports.push_back({i, {o, x, o, x, o, x}});
  model.loads = {{elements_of_column, {0, 0, -load}}};
  return model;
}

/// P L^2 / EI: stability function of the column plus 4 of the beam.
double critical_load_of_frame() {
  const auto stiffness = [](double k) {
    return k * (std::sin(k) - k * std::cos(k)) / (2 - 2 * std::cos(k) - k * std::sin(k)) + 4;
  };
  double low = 4.5, high = 6.2;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (stiffness(middle) > 0 ? low : high) = middle;
  }
  return low * low;
}

TEST(BeamFinerJudgement, ABracedFrameWithAColumnOfOneElement) {
  const double critical = critical_load_of_frame();
  EXPECT_GT(critical, 20.19);
  EXPECT_LT(critical, 39.5);
  expect_stable(find_equilibrium(BeamStructure(braced_frame(1, 0.97 * critical))));
  expect_doubted(find_equilibrium(BeamStructure(braced_frame(1, 1.03 * critical))), 0);
  // Short enough they show it themselves.
  const BeamSolution buckled = find_equilibrium(BeamStructure(braced_frame(8, 1.03 * critical)));
  expect_stable(buckled);
  EXPECT_GT(buckled.state.positions.row(0).head(9).cwiseAbs().maxCoeff(), 0.01);
}

/// Greenhill: 8.987 EI / L between clamps, one of which is free along the rod.
BeamModel twisted_rod(int elements, double torque) {
  BeamModel model = straight_beam(elements, 1, 200);
  model.supports = {clamped(0)};
  PrescribedMotion motion;
  motion.node = elements;
  motion.translates = {false, true, true};
  motion.rotates = {true, true, true};
  motion.rotation = {torque / model.sections[0].torsion, 0, 0};
  model.motions = {motion};
  return model;
}

TEST(BeamFinerJudgement, ATwistedRodIsStableUpToGreenhillsTorque) {
  constexpr double kGreenhill = 8.98681891;
  for (const int elements : {10, 12, 16, 48}) {
    SCOPED_TRACE(elements);
    expect_stable(find_equilibrium(BeamStructure(twisted_rod(elements, 0.99 * kGreenhill))));
    const BeamSolution above =
        find_equilibrium(BeamStructure(twisted_rod(elements, 1.01 * kGreenhill)));
    const double aside = above.state.positions.bottomRows<2>().cwiseAbs().maxCoeff();
    EXPECT_TRUE(!above.report.converged() || aside > 0.01)
        << "straight and without a word: " << above.report.message;
  }
}

/// 3000 elements that are held at their ends, pressed to 0.38 times what buckles them.
TEST(BeamFinerJudgement, TooManyElementsAreNotJudgedAndNamed) {
  constexpr int kElements = 3000;
  constexpr double kCompression = 15;  // N L^2 / EI
  BeamModel model = straight_beam(kElements, 1, 1e6);
  model.supports = {clamped(0)};
  for (int i = 1; i <= kElements; ++i)
    model.supports.push_back({i, {false, true, true, true, true, true}});
  model.loads = {{kElements, {-kCompression * kElements * kElements, 0, 0}}};
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_FALSE(found.report.negative_eigenvalues.has_value());
  EXPECT_EQ(found.report.unjudged_elements.size(), kElements);
  EXPECT_NE(found.report.message.find("stability not judged: element 0, "), std::string::npos)
      << found.report.message;
}

enum class StripLoad { kAtTip, kSpread };

/// A strip that stands upright, clamped at one end, under a share of the load down that tips it
/// over: 4.013 sqrt(EI GJ) / L^2 at the tip, 12.85 sqrt(EI GJ) / L^3 over its length (Prandtl,
/// Michell).
BeamModel upright_strip(int elements, StripLoad load, double share) {
  BeamModel model = straight_beam(elements, 1, 1e4);
  model.sections[0].bending_2 = 400;
  model.supports = {clamped(0)};
  if (load == StripLoad::kAtTip) {
    model.loads = {{elements, {0, 0, -4.013 * share}}};
  } else {
    for (int i = 0; i < elements; ++i)
      model.distributed_loads.push_back({i, {0, 0, -12.85 * share}});
  }
  return model;
}

TEST(BeamFinerJudgement, CoarseStripsThatTipOverAreDoubted) {
  for (const StripLoad load : {StripLoad::kAtTip, StripLoad::kSpread}) {
    const auto aside = [&](int elements, double share) {
      const BeamSolution found =
          find_equilibrium(BeamStructure(upright_strip(elements, load, share)));
      EXPECT_TRUE(found.report.converged()) << found.report.message;
      return found.state.positions.row(1).cwiseAbs().maxCoeff();
    };
    EXPECT_LT(aside(24, 0.97), 1e-6);
    EXPECT_GT(aside(24, 1.03), 0.05);
    for (const int elements : {1, 2}) {
      SCOPED_TRACE(elements);
      expect_stable(find_equilibrium(BeamStructure(upright_strip(elements, load, 0.97))));
      for (const double share : {1.03, 1.6}) {
        const BeamSolution found =
            find_equilibrium(BeamStructure(upright_strip(elements, load, share)));
        EXPECT_FALSE(found.report.negative_eigenvalues.has_value());
        EXPECT_FALSE(found.report.unjudged_elements.empty()) << found.report.message;
      }
    }
  }
}

TEST(BeamFinerJudgement, NothingIsSaidWhereNothingIsPressedOrTwisted) {
  const BeamStructure structure(limber::testing::cantilever_model(4, 1));
  const BeamSolution found = find_equilibrium(structure);
  EXPECT_FALSE(detail::look_with_shorter_elements(structure, found.state, {}));
}

}  // namespace
}  // namespace limber::beams
