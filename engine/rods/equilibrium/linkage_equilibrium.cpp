#include "engine/rods/equilibrium/linkage_equilibrium.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/newton_run.h"

namespace limber::rods {
namespace {

void refuse(const char* name, const char* rule, double value) {
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("{} must be {}, got {}", name, rule, value));
}

/// A component that loads push and nothing holds has no equilibrium.
/// @returns a message, empty where there is none
std::string unbalanced_component(const LinkageModel& model, const Conditions& conditions) {
  const detail::ConditionTerms terms(model, conditions);
  const std::vector<int> components = detail::joint_components(model.graph());
  const auto resultants = terms.resultants();
  std::vector<char> held(resultants.size(), 0);
  for (const JointPin& pin : conditions.pins)
    if (pin.hold != Hold::kAngle) held[components[pin.joint]] = 1;
  for (const detail::SpringPoint& spring : terms.springs()) {
    held[spring.joint >= 0 ? components[spring.joint]
                           : model.graph().segment_components[spring.segment]] = 1;
  }
  for (std::size_t c = 0; c < resultants.size(); ++c) {
    const double force = resultants[c].force.norm();
    if (held[c] == 0 && force > 1e-9 * resultants[c].magnitudes) {
      return fmt::format("loads push component {} with a force of {:.3g} and nothing holds it", c,
                         force);
    }
  }
  return {};
}

}  // namespace

void EquilibriumOptions::validate() const {
  if (max_iterations <= 0) refuse("max_iterations", "> 0", max_iterations);
  if (!(tolerance > 0 && tolerance < 1)) refuse("tolerance", "in (0, 1)", tolerance);
  if (!(largest_turn > 0 && largest_turn <= 1.5))
    refuse("largest_turn", "in (0, 1.5]", largest_turn);
  if (max_escapes < 0) refuse("max_escapes", ">= 0", max_escapes);
}

LinkageEquilibrium::LinkageEquilibrium(const LinkageModel& model)
    : workspace_(std::make_unique<detail::NewtonWorkspace>(model)) {}
LinkageEquilibrium::~LinkageEquilibrium() = default;
LinkageEquilibrium::LinkageEquilibrium(LinkageEquilibrium&&) noexcept = default;
LinkageEquilibrium& LinkageEquilibrium::operator=(LinkageEquilibrium&&) noexcept = default;

const LinkageModel& LinkageEquilibrium::model() const { return workspace_->model; }
const Eigen::VectorXd& LinkageEquilibrium::last_increment() const {
  return workspace_->total_increment;
}

EquilibriumReport LinkageEquilibrium::solve(LinkageState& state, const Conditions& conditions,
                                            const EquilibriumOptions& options,
                                            const JobContext& context,
                                            const IterateCallback& on_iterate) {
  options.validate();
  conditions.validate(workspace_->model);
  std::string unbalanced = unbalanced_component(workspace_->model, conditions);
  if (!unbalanced.empty()) {
    EquilibriumReport report;
    report.status = EquilibriumStatus::kUnbalanced;
    report.message = std::move(unbalanced);
    report.energies = workspace_->assembly.energies(state);
    return report;
  }
  detail::NewtonRun run(*workspace_, conditions, options, state);
  return run.run(state, context, on_iterate);
}

}  // namespace limber::rods
