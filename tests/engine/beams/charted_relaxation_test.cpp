#include "tests/support/charted_relaxation.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "engine/base/error.h"
#include "tests/support/beam_problems.h"

// The baseline of `limber-bench beams`: the paper's relaxation in its chart of the normal.

namespace limber::testing {
namespace {

using beams::BeamModel;
using beams::BeamStatus;
using Eigen::Vector3d;

/// For structures whose length and stiffness are of the size of 1.
ChartedOptions unit_options() {
  ChartedOptions options;
  options.residual = 1e-6;
  options.rest_energy = 1e-26;
  return options;
}

/// Three elements that meet at a node at angles, and one more behind; nothing in a plane or
/// symmetric; one clamped end, one end with a prescribed displacement.
BeamModel star() {
  BeamModel model;
  model.sections.push_back({900, 0.8, 1, 2});
  for (const Vector3d& place : {Vector3d(0, 0, 0), Vector3d(1, 0.2, 0.1), Vector3d(-0.4, 0.9, 0),
                                Vector3d(-0.3, -0.8, 0.2), Vector3d(1.6, 0.9, 0)})
    model.nodes.push_back({place, {0.1 * place.x(), 0, 1}});
  for (const auto& [a, b] : {std::pair{0, 1}, {2, 0}, {0, 3}, {1, 4}}) {
    beams::BeamElement e;
    e.start = a;
    e.finish = b;
    model.elements.push_back(e);
  }
  model.supports.push_back(clamped(2));
  model.supports.push_back({3, {true, true, true, false, false, true}});
  model.loads.push_back({4, {0.3, -0.2, 0.5}});
  return model;
}

TEST(ChartedRelaxation, ForcesAreThoseOfTheEnergy) {
  const BeamModel model = star();
  const ChartedStructure structure(model);
  ChartedUnknowns at = structure.rest();
  for (Eigen::Index i = 0; i < at.cols(); ++i)
    for (Eigen::Index k = 0; k < 6; ++k)
      at(k, i) += 0.1 * std::sin(static_cast<double>(3 + 5 * k + 7 * i));
  const ChartedUnknowns forces = structure.unbalanced(at, ChartedStructure::Temporary::kOff);
  ChartedUnknowns probe = at;
  const double step = 1e-6;
  for (int i = 0; i < structure.nodes(); ++i) {
    for (int k = 0; k < 6; ++k) {
      const bool held = i == 2 || (i == 3 && (k < 3 || k == 5));
      probe(k, i) = at(k, i) + step;
      const double above = structure.elastic_energy(probe);
      probe(k, i) = at(k, i) - step;
      const double load = i == 4 && k < 3 ? model.loads[0].force[k] : 0;
      const double expected = load - (above - structure.elastic_energy(probe)) / (2 * step);
      probe(k, i) = at(k, i);
      EXPECT_NEAR(forces(k, i), held ? 0 : expected, 1e-6) << "node " << i << ", unknown " << k;
    }
  }
}

TEST(ChartedRelaxation, CantileverOfASmallLoadIsRight) {
  const ChartedResult found =
      relax_charted(ChartedStructure(cantilever_model(10, 0.2)), unit_options());
  EXPECT_EQ(found.status, BeamStatus::kConverged);
  EXPECT_NEAR(found.unknowns(2, 10), .06636, 0.01 * .06636);
  EXPECT_NEAR(1 - found.unknowns(0, 10), .00265, 0.01 * .00265);
}

TEST(ChartedRelaxation, IsThePublicCodeOnItsCantilever) {
  // A metre of 15 mm square, E = 1 GPa, 5 N at the tip; its places and 6191 steps, as measured.
  BeamModel model = straight_beam(10);
  model.sections[0] =
      beams::make_section(beams::rectangle(0.015, 0.015), {1e9, 0.30000001192092896, 0, 0});
  model.supports.push_back(clamped(0));
  model.loads.push_back({10, {0, 0, 5}});
  const ChartedResult found = relax_charted(ChartedStructure(model));
  EXPECT_EQ(found.status, BeamStatus::kConverged);
  EXPECT_NEAR(found.steps, 6191, 60);
  EXPECT_LT((found.unknowns.col(5).head<3>() - Vector3d(.48414641, 0, .11115067)).norm(), 1e-6);
  EXPECT_LT((found.unknowns.col(10).head<3>() - Vector3d(.92510603, 0, .34611546)).norm(), 1e-6);
}

TEST(ChartedRelaxation, MomentsAcrossTheNormalBendAndThoseAboutItHardly) {
  // At the tip, of 0.3 EI / L: an arc of 0.3 rad.
  BeamModel model = cantilever_model(10, 0.2);
  model.loads[0].force.setZero();
  model.loads[0].moment = {0, -0.3, 0};
  const ChartedResult across = relax_charted(ChartedStructure(model), unit_options());
  EXPECT_EQ(across.status, BeamStatus::kConverged);
  EXPECT_NEAR(across.unknowns(2, 10), (1 - std::cos(0.3)) / 0.3, 1e-3);
  EXPECT_NEAR(across.unknowns(0, 10), std::sin(0.3) / 0.3, 1e-3);
  model.loads[0].moment = {0, 0, 0.3};
  const ChartedResult about = relax_charted(ChartedStructure(model), unit_options());
  EXPECT_TRUE(about.unknowns.allFinite());
  EXPECT_LT(std::abs(about.unknowns(1, 10)), 0.2 * 0.149);
}

/// The same load and support in the plane of the normals or across it.
BeamModel turned_cantilever(bool in_plane) {
  BeamModel model = cantilever_model(8, 0.5);
  model.sections[0].bending_3 = model.sections[0].bending_2;
  if (in_plane) model.loads[0].force = {0, model.loads[0].force.z(), 0};
  return model;
}

TEST(ChartedRelaxation, BothBendingForcesBendAlike) {
  const ChartedResult first =
      relax_charted(ChartedStructure(turned_cantilever(false)), unit_options());
  const ChartedResult second =
      relax_charted(ChartedStructure(turned_cantilever(true)), unit_options());
  EXPECT_EQ(first.status, BeamStatus::kConverged);
  EXPECT_EQ(second.status, BeamStatus::kConverged);
  EXPECT_NEAR(second.unknowns(1, 8), first.unknowns(2, 8), 2e-3);
  EXPECT_NEAR(second.unknowns(0, 8), first.unknowns(0, 8), 2e-3);
}

TEST(ChartedRelaxation, BendInSpaceIsRightInSuitableUnits) {
  BeamModel model = bend_model(10, 300, 1.0 / 6);
  for (beams::BeamNode& node : model.nodes) node.position /= 100;
  for (double* stiffness :
       {&model.sections[0].torsion, &model.sections[0].bending_2, &model.sections[0].bending_3})
    *stiffness /= 1e4;
  ChartedOptions options = unit_options();
  options.residual = 1e-4;
  const ChartedResult found = relax_charted(ChartedStructure(model), options);
  EXPECT_EQ(found.status, BeamStatus::kConverged);
  const Vector3d tip = 100 * found.unknowns.col(10).head<3>();
  EXPECT_LT((tip - Vector3d(58.780, 22.245, 40.189)).norm(), 0.002 * 78.54);
}

TEST(ChartedRelaxation, ElementsTooLongForTheMassesAreUnstableAndStayNumbers) {
  const ChartedResult found =
      relax_charted(ChartedStructure(bend_model(10, 300, 1.0 / 6)), unit_options());
  EXPECT_EQ(found.status, BeamStatus::kUnstable);
  EXPECT_TRUE(found.unknowns.allFinite());
}

TEST(ChartedRelaxation, NothingRollsUp) {
  ChartedOptions options = unit_options();
  options.steps = 30000;
  const ChartedResult found = relax_charted(ChartedStructure(roll_up_model(10)), options);
  EXPECT_NE(found.status, BeamStatus::kConverged);
  EXPECT_TRUE(found.unknowns.allFinite());
  EXPECT_GT(found.unknowns.col(10).head<3>().norm(), 0.5) << "the tip is not back at the root";
}

TEST(ChartedRelaxation, PrescribedMotionsArrive) {
  BeamModel model = star();
  beams::PrescribedMotion motion;
  motion.node = 4;
  motion.translates = {true, false, true};
  motion.translation = {-0.1, 0, 0.2};
  model.motions.push_back(motion);
  ChartedOptions options = unit_options();
  const ChartedStructure structure(model);
  const ChartedResult found = relax_charted(structure, options);
  EXPECT_EQ(found.status, BeamStatus::kConverged);
  EXPECT_GT(found.steps, options.motion_until);
  EXPECT_DOUBLE_EQ(found.unknowns(0, 4), 1.5);
  EXPECT_DOUBLE_EQ(found.unknowns(2, 4), 0.2);
  EXPECT_LT(structure.unbalanced(found.unknowns, ChartedStructure::Temporary::kOff).norm(), 1e-5);
}

TEST(ChartedRelaxation, RefusesWhatThePaperDoesNotHave) {
  BeamModel model = star();
  model.elements[0].finish_release.rotations[1] = true;
  EXPECT_THROW(ChartedStructure{model}, Error);
  model = star();
  model.nodes[0].normal = {0, 0, -1};
  EXPECT_THROW(ChartedStructure{model}, Error);
  model = star();
  model.gravity.z() = -1;
  EXPECT_THROW(ChartedStructure{model}, Error);
}

}  // namespace
}  // namespace limber::testing
