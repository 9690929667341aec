#include "engine/session/bodies/weight_scale.h"

#include <gtest/gtest.h>

#include "engine/session/bodies/material_outcome.h"

namespace limber::session {
namespace {

/// A message that is a sentence is continued, not followed by ".;".
TEST(WeightScale, ContinuesTheMessageOfTheSolve) {
  scene::Scene scene;
  scene.constraint_tolerance = 0.01;
  spacetime::SolveReport report;
  report.max_constraint_error = 0.5;
  report.message = "Stopped at the iteration limit before convergence.";
  tell_tolerance(scene, 100, report);
  EXPECT_EQ(report.message,
            "Stopped at the iteration limit before convergence; constraint_tolerance 0.01 is not "
            "met: 0.5 is missed with weights raised 100 times");
}

TEST(WeightScale, AFitContinuesItToo) {
  spacetime::MaterialReport material;
  material.message = "the material's optimisation was cancelled";
  spacetime::SolveReport report;
  report.message = "Cancelled; the motion is the last improved one.";
  report_outcome(material, report);
  EXPECT_EQ(report.message,
            "Cancelled; the motion is the last improved one; the material's optimisation was "
            "cancelled");
}

}  // namespace
}  // namespace limber::session
