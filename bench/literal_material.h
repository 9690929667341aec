#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/reduced/kinematics.h"
#include "engine/spacetime/material.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/problem.h"

namespace limber::bench {

struct LiteralMaterialOptions {
  spacetime::MaterialVariables variables = spacetime::MaterialVariables::kAll;
  double column_weight = 1;  // mu
  int outer_rounds = 30;
  int z_iterations = 30;       // at most, a round
  double z_tolerance = 1e-4;   // scaled gradient, as SolverOptions::gradient_tolerance
  int mixing_iterations = 50;  // of L-BFGS, a round
  // The bounds of spacetime::MaterialOptions, in rounds instead of steps; 1/2 and 0: the paper's.
  double max_frequency = 1.0 / 8;  // [1/frame]
  int slow_rounds = 10;
  double slow_frequency = spacetime::MaterialOptions::kSlowestNeeded;  // [1/frame]
};

struct LiteralMaterialResult {
  spacetime::Material material;
  Eigen::MatrixXd motion;  // z, r x N
  double force_energy = 0, constraint_energy = 0, total_energy = 0;
  double max_constraint_error = 0;             // body lengths
  int inner_iterations = 0;                    // as the paper's table 1 counts them
  std::vector<double> energies, milliseconds;  // after each outer round, since the call
};

/// Material optimisation as the paper has it (space-time editing, section 5), written plainly. In
/// turn z by Gauss-Newton with CHOLMOD (testing::LiteralSpacetime), Lambda, then D, each alone and
/// clipped at its bounds (zero, and for Lambda those of the options too). Then S by at most 50
/// iterations of L-BFGS (liblbfgs). Baseline of the benchmark.
///
/// Accelerations: the first z is led through rising weights (solve_continued()) if that ends lower.
/// H_f and the pattern of H_z are made once a round, and z starts from the round before.
[[nodiscard]] LiteralMaterialResult literal_material(
    const std::shared_ptr<const reduced::Kinematics>& kinematics,
    const spacetime::Timeline& timeline,
    const std::vector<spacetime::PositionConstraint>& constraints, spacetime::Material start,
    const LiteralMaterialOptions& options);

}  // namespace limber::bench
