#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/equilibrium/length_system.h"
#include "engine/rods/equilibrium/rest_length_solve.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/solver/condensed_matrix.h"

namespace limber::rods::detail {

/// One search for rest lengths; see solve_rest_lengths.
class RestLengthRun {
 public:
  RestLengthRun(LinkageModel& model, LinkageState& state, const RestLengthOptions& options,
                const JobContext& context);

  RestLengthReport run();

 private:
  [[nodiscard]] double progress();
  [[nodiscard]] bool improve();
  void pin_positions();
  void evaluate();
  [[nodiscard]] bool balanced() const;
  void set_active();
  [[nodiscard]] bool factor();
  bool factor_shifted(double shift);
  [[nodiscard]] LinkageVector solve(const LinkageVector& right_side);
  [[nodiscard]] bool block(const LinkageVector& step);
  [[nodiscard]] double room(const LinkageVector& step) const;
  [[nodiscard]] bool take(const LinkageVector& step);
  [[nodiscard]] bool try_step(const LinkageVector& step, double energy_below);
  [[nodiscard]] bool is_short(const LinkageState& trial) const;

  LinkageModel& model_;
  LinkageState& state_;
  const RestLengthOptions& options_;
  const JobContext& context_;
  UnknownScales scales_;
  LinkageAssembly assembly_;
  LinkageDerivatives derivatives_;
  CondensedMatrix matrix_;
  LengthSystem system_;
  Eigen::VectorXd low_, high_;  // of rest lengths
  std::vector<int> pinned_;
  std::vector<char> is_pinned_;
  LinkageVector gradient_;               // zero where pinned
  std::vector<char> active_;             // segments that stay on their bound
  LinkageDerivatives::ByLengths mixed_;  // of this iterate
  double shift_ = 0;
  double first_imbalance_ = 0, progress_ = 0;
  RestLengthReport report_;
};

}  // namespace limber::rods::detail
