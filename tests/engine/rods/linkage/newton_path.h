#pragma once

#include <Eigen/Core>
#include <numbers>

#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/solver/bordered_solver.h"
#include "engine/rods/solver/condensed_solver.h"

namespace limber::rods::testing {

/// Equilibria of a linkage with one joint's position and orientation held, by a plain Newton
/// iteration: enough to compare with known answers.
class NewtonPath {
 public:
  NewtonPath(const LinkageModel& model, int held_joint)
      : state(model),
        model_(model),
        assembly_(model),
        matrix_(model.chains()),
        solver_(model.chains()),
        gradient_(model.variables().size()),
        mean_row_(Eigen::MatrixXd::Zero(1, model.variables().size())) {
    std::vector<int> pinned;
    for (int k = 0; k < 6; ++k) pinned.push_back(model.variables().joint_begin(held_joint) + k);
    solver_.set_pinned(pinned);
    for (int j = 0; j < model.variables().joints(); ++j)
      mean_row_(0, model.variables().joint_begin(j) + kJointAngle) =
          1.0 / model.variables().joints();
    held_ = pinned;
  }

  /// Without constraint on the angles.
  double settle() { return settle_rows(Eigen::MatrixXd(0, gradient_.size()), Eigen::VectorXd(0)); }

  /// At a mean opening angle [rad].
  double settle_at(double mean_angle) {
    Eigen::VectorXd gap(1);
    gap[0] = mean_angle - state.mean_opening_angle();
    return settle_rows(mean_row_, gap);
  }

  [[nodiscard]] RodEnergies energies() { return assembly_.energies(state); }

  LinkageState state;
  int iterations = 0;

 private:
  double settle_rows(const Eigen::MatrixXd& rows, Eigen::VectorXd gap) {
    double energy = assembly_.energies(state).total();
    for (int round = 0; round < 60; ++round) {
      ++iterations;
      (void)assembly_.hessian(state, gradient_, matrix_);
      for (const int unknown : held_) gradient_[unknown] = 0;
      const Eigen::VectorXd step = newton_step(rows, gap);
      const double predicted = -gradient_.dot(step);
      const bool moves_angles = gap.size() > 0 && gap[0] != 0;
      double length = 1;
      LinkageState next = state.moved(model_, step);
      double next_energy = assembly_.energies(next).total();
      // The energy may rise while the constraint is being reached; after that it must fall.
      while (!moves_angles && next_energy > energy - 1e-4 * length * predicted + 1e-13 * energy &&
             length > 1e-8) {
        length /= 2;
        next = state.moved(model_, length * step);
        next_energy = assembly_.energies(next).total();
      }
      state = next;
      energy = next_energy;
      gap.setZero();
      if (!moves_angles && std::abs(predicted) < 1e-15 * (1e-3 + energy)) break;
    }
    return energy;
  }

  Eigen::VectorXd newton_step(const Eigen::MatrixXd& rows, const Eigen::VectorXd& gap) {
    for (double shift = 0;; shift = shift == 0 ? 1e-8 : 8 * shift) {
      (void)solver_.factor(matrix_, shift);
      if (solver_.pivots().vanishing > 0) continue;
      const BorderedSolver bordered(solver_, rows, Eigen::VectorXd::Zero(rows.rows()));
      if (!bordered.positive_definite()) continue;
      Eigen::VectorXd step = -gradient_;
      Eigen::VectorXd forces = gap;
      bordered.solve_in_place(step, forces);
      return step;
    }
  }

  const LinkageModel& model_;
  LinkageAssembly assembly_;
  CondensedMatrix matrix_;
  CondensedSolver solver_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd mean_row_;
  std::vector<int> held_;
};

}  // namespace limber::rods::testing
