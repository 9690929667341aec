#include "engine/rods/equilibrium/linkage_equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/start_shift.h"
#include "engine/rods/equilibrium/newton_run.h"

namespace limber::rods {
namespace {

/// Share of the present forces: pins exert smaller ones by rounding.
constexpr double kNoReaction = 1e-6;

void refuse_equilibrium_option(const char* name, const char* rule, double value) {
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("{} must be {}, got {}", name, rule, value));
}

/// Name of a component by its joints for users, and the supports that would hold it.
struct Part {
  std::string name, remedy;
};
Part part_of(const LinkageModel& model, const std::vector<int>& components, std::size_t c) {
  const auto joint = std::find(components.begin(), components.end(), static_cast<int>(c));
  if (joint == components.end()) return {"a rod without joints", "attach it to a target"};
  if (model.graph().components == 1) return {"the linkage", "pin a joint"};
  return {fmt::format("the part of joint {}", joint - components.begin()), "pin one of its joints"};
}

/// A component that loads push and nothing holds has no equilibrium.
/// @returns a message, empty where there is none
std::string unbalanced_component(const LinkageModel& model, const Conditions& conditions) {
  if (conditions.loads.empty() && conditions.gravity.acceleration.isZero(0)) return {};
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
      const Part part = part_of(model, components, c);
      return fmt::format(
          "the loads on {} have a resultant of {:.3g} N, and no support holds it: {}", part.name,
          force, part.remedy);
    }
    // Forces, if there are any, may turn into a couple that balances moments.
    const double moment = resultants[c].moment.norm();
    if (held[c] == 0 && resultants[c].magnitudes == 0 &&
        moment > 1e-9 * resultants[c].moment_magnitudes) {
      const Part part = part_of(model, components, c);
      return fmt::format(
          "the moments on {} have a resultant of {:.2g} % of their sum, and no support holds it: "
          "{}",
          part.name, 100 * moment / resultants[c].moment_magnitudes, part.remedy);
    }
  }
  return {};
}

}  // namespace

void EquilibriumOptions::validate() const {
  if (max_iterations <= 0) refuse_equilibrium_option("max_iterations", "> 0", max_iterations);
  if (!(tolerance > 0 && tolerance < 1))
    refuse_equilibrium_option("tolerance", "in (0, 1)", tolerance);
  if (!(largest_turn > 0 && largest_turn <= 1.5))
    refuse_equilibrium_option("largest_turn", "in (0, 1.5]", largest_turn);
  if (max_escapes < 0) refuse_equilibrium_option("max_escapes", ">= 0", max_escapes);
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

EquilibriumReport LinkageEquilibrium::judge(const LinkageState& state, const Conditions& conditions,
                                            const EquilibriumOptions& options) {
  options.validate();
  conditions.validate(workspace_->model);
  workspace_->certified = false;
  workspace_->begin_at(state);
  return detail::NewtonRun(*workspace_, conditions, options, state).judge(state);
}

std::vector<JointLoad> LinkageEquilibrium::reactions(const LinkageState& state,
                                                     const Conditions& conditions) {
  conditions.validate(workspace_->model);
  const EquilibriumOptions options;
  detail::NewtonRun run(*workspace_, conditions, options, state);
  const Eigen::VectorXd& gradient = run.gradient_at(state);
  const double force = kNoReaction * run.forces_present().force;
  const double moment = kNoReaction * run.forces_present().moment;
  std::vector<JointLoad> held(static_cast<std::size_t>(workspace_->model.variables().joints()));
  for (std::size_t j = 0; j < held.size(); ++j) held[j].joint = static_cast<int>(j);
  const auto begin = [&](const JointLoad& load) {
    return workspace_->model.variables().joint_begin(load.joint);
  };
  const auto hold_angle = [&](JointLoad& load) {
    load.opening_torque = gradient[begin(load) + kJointAngle];
  };
  if (conditions.mean_opening_angle) std::for_each(held.begin(), held.end(), hold_angle);
  for (const AngleSetting& setting : conditions.angles) hold_angle(held[setting.joint]);
  for (const JointPin& pin : conditions.pins) {
    JointLoad& load = held[pin.joint];
    if (pin.hold != Hold::kMotion) hold_angle(load);
    if (pin.hold == Hold::kAngle) continue;
    load.force = gradient.segment<3>(begin(load) + kJointPosition);
    load.moment = gradient.segment<3>(begin(load) + kJointRotation);
  }
  for (JointLoad& load : held) {
    const auto rounding = [&](int unknown) {
      return workspace_->scales.rounding(begin(load) + unknown);
    };
    if (load.force.norm() <= std::max(force, rounding(kJointPosition))) load.force.setZero();
    if (load.moment.norm() <= std::max(moment, rounding(kJointRotation))) load.moment.setZero();
    if (std::abs(load.opening_torque) <= std::max(moment, rounding(kJointAngle)))
      load.opening_torque = 0;
  }
  std::erase_if(held, [](const JointLoad& load) {
    return load.force.isZero(0) && load.moment.isZero(0) && load.opening_torque == 0;
  });
  return held;
}

Eigen::VectorXd LinkageEquilibrium::softest_direction(const LinkageState& state,
                                                      const Conditions& conditions) {
  conditions.validate(workspace_->model);
  const EquilibriumOptions options;
  detail::NewtonRun run(*workspace_, conditions, options, state);
  return run.softest_at(state);
}

LinkageEquilibrium::Motion LinkageEquilibrium::motion(const LinkageState& state,
                                                      const Conditions& here,
                                                      const Conditions& ahead) {
  here.validate(workspace_->model);
  ahead.validate(workspace_->model);
  const EquilibriumOptions options;
  detail::NewtonRun next(*workspace_, ahead, options, state);
  return detail::NewtonRun(*workspace_, here, options, state).motion_to(next, state);
}

std::unique_ptr<HessianFactor> LinkageEquilibrium::take_factor(
    std::unique_ptr<HessianFactor>&& spare) {
  detail::NewtonWorkspace& work = *workspace_;
  if (!work.certified || !work.factor->bordered || work.factor->shift != 0) return nullptr;
  work.certified = false;
  std::unique_ptr<HessianFactor> taken = std::move(work.factor);
  taken->gradient = work.gradient;
  work.factor = spare ? std::move(spare) : std::make_unique<HessianFactor>(work.model.chains());
  work.factor->bordered.reset();
  work.factor->solver.set_shift_weights(work.scales.weights());
  return taken;
}

namespace {

/// Did the last solve end at this state? If so, it is no start.
bool ended_at(const detail::NewtonWorkspace& work, const LinkageState& state) {
  return std::equal(work.end.begin(), work.end.end(), state.joints().begin(), state.joints().end(),
                    [](const JointState<double>& a, const JointState<double>& b) {
                      return a.position == b.position;
                    });
}

/// As other processors' last digits might have it: see start_shift().
LinkageState begun(const detail::NewtonWorkspace& work, const LinkageState& state) {
  Eigen::VectorXd moves = start_moves(work.scales.weights().size());
  for (Eigen::Index unknown = 0; unknown < moves.size(); ++unknown)
    if (work.scales.kind(static_cast<int>(unknown)) == detail::UnknownKind::kLength)
      moves[unknown] *= work.scales.extent();
  return state.moved(work.model, moves);
}

}  // namespace

void LinkageEquilibrium::expect_step(const LinkageState& from, const Eigen::VectorXd& step) {
  workspace_->factor->bordered.reset();
  workspace_->tensions.expect(workspace_->model, from, step);
  workspace_->expected = true;
}

EquilibriumReport LinkageEquilibrium::solve(LinkageState& state, const Conditions& conditions,
                                            const EquilibriumOptions& options,
                                            const JobContext& context,
                                            const IterateCallback& on_iterate) {
  options.validate();
  conditions.validate(workspace_->model);
  workspace_->certified = false;
  std::string unbalanced = unbalanced_component(workspace_->model, conditions);
  if (!unbalanced.empty()) {
    EquilibriumReport report;
    report.status = EquilibriumStatus::kUnbalanced;
    report.message = std::move(unbalanced);
    report.energies = workspace_->assembly.energies(state);
    return report;
  }
  if (start_shift() > 0 && !ended_at(*workspace_, state)) state = begun(*workspace_, state);
  workspace_->begin_at(state);
  detail::NewtonRun run(*workspace_, conditions, options, state);
  EquilibriumReport report = run.run(state, context, on_iterate);
  workspace_->end = state.joints();
  workspace_->certified = report.converged();
  workspace_->expected = false;
  return report;
}

}  // namespace limber::rods
