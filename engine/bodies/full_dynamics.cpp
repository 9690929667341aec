#include "engine/bodies/full_dynamics.h"

#include <cmath>
#include <string>

#include "engine/base/error.h"
#include "engine/base/numerics/line_search.h"
#include "engine/bodies/mass.h"

namespace limber::bodies {
namespace {

constexpr int kLineSearchSteps = 40;
/// A decrease below this part of the potential cannot be seen in it.
constexpr double kRounding = 1e-13;

void demand(bool ok, const char* field, double value, const char* rule) {
  if (ok) return;
  throw Error(ErrorCode::kInvalidArgument, field,
              std::string(field) + " = " + std::to_string(value) + " must be " + rule);
}

}  // namespace

void DynamicsOptions::validate() const {
  demand(std::isfinite(time_step) && time_step > 0, "time_step", time_step, "> 0 and finite");
  demand(std::isfinite(mass_damping) && mass_damping >= 0, "mass_damping", mass_damping,
         ">= 0 and finite");
  demand(std::isfinite(relaxation_time) && relaxation_time >= 0, "relaxation_time", relaxation_time,
         ">= 0 and finite");
  demand(tolerance >= 1e-12 && tolerance < 1, "tolerance", tolerance, "in [1e-12, 1)");
  demand(max_newton_steps >= 1, "max_newton_steps", max_newton_steps, ">= 1");
}

/// Constants of a step's minimisation. All but `memory` are unscaled: joules.
struct FullDynamics::Potential {
  double reach;              // D [s]: from the step's begin to where its forces act
  Eigen::VectorXd begin;     // u [m]
  Eigen::VectorXd inertial;  // u + D v [m]
  Eigen::VectorXd force;     // [N], zero at fixed nodes
  StrainMemory memory;
  double scale;  // energies at play before the step [J]
};

FullDynamics::FullDynamics(const ElasticBody& body, const DynamicsOptions& options)
    : body_(body),
      options_(options),
      gradient_(body.mesh),
      elasticity_(body.mesh, gradient_),
      dofs_(DofMap::of_vectors(body.mesh.node_count(), body.fixed_nodes)),
      mass_(mass_matrix(body.mesh)),
      free_mass_(dofs_.restrict_matrix(mass_)) {
  options_.validate();
  state_.displacement = state_.velocity = Eigen::VectorXd::Zero(dofs_.full_count());
  cholesky_.analyse(dofs_.restrict_matrix(
      elasticity_.hessian(state_.displacement, StvkEnergy::Curvature::kExact)));
}

void FullDynamics::set_state(DynamicState state) {
  for (const auto& [name, values] :
       {std::pair{"displacement", &state.displacement}, {"velocity", &state.velocity}}) {
    if (values->size() != dofs_.full_count()) {
      throw Error(ErrorCode::kInvalidArgument, name,
                  std::string(name) + " has " + std::to_string(values->size()) +
                      " entries, the body " + std::to_string(dofs_.full_count()));
    }
    if (!values->allFinite())
      throw Error(ErrorCode::kInvalidArgument, name, std::string(name) + " is not finite");
    for (const int node : body_.fixed_nodes) {
      if (!values->segment<3>(3 * node).isZero(0)) {
        throw Error(ErrorCode::kInvalidArgument, name,
                    std::string(name) + " moves node " + std::to_string(node) + ", which is fixed");
      }
    }
  }
  state_ = std::move(state);
}

double FullDynamics::kinetic_energy() const {
  return state_.velocity.dot(mass_ * state_.velocity) / 2;
}

double FullDynamics::elastic_energy() const { return elasticity_.value(state_.displacement); }

double FullDynamics::value(const Potential& potential, const Eigen::VectorXd& w) const {
  const Eigen::VectorXd late = w - potential.inertial, displacement = w - potential.begin;
  const double d = potential.reach;
  return late.dot(mass_ * late) / (2 * d * d) +
         options_.mass_damping * displacement.dot(mass_ * displacement) / (2 * d) +
         elasticity_.value(w, potential.memory) - potential.force.dot(displacement);
}

Eigen::VectorXd FullDynamics::gradient(const Potential& potential, const Eigen::VectorXd& w) const {
  const double d = potential.reach;
  const Eigen::VectorXd pull =
      (w - potential.inertial) / (d * d) + options_.mass_damping / d * (w - potential.begin);
  const Eigen::VectorXd full =
      mass_ * pull + elasticity_.gradient(w, potential.memory) - potential.force;
  return dofs_.restrict_rows(full);
}

void FullDynamics::factor(const Potential& potential, const Eigen::VectorXd& w) {
  using Curvature = StvkEnergy::Curvature;
  const double inertia =
      (1 + options_.mass_damping * potential.reach) / (potential.reach * potential.reach);
  for (const Curvature curvature : {Curvature::kExact, Curvature::kPositive}) {
    const Eigen::SparseMatrix<double> system =
        inertia * free_mass_ +
        dofs_.restrict_matrix(elasticity_.hessian(w, curvature, potential.memory));
    try {
      return cholesky_.refactor(system);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kNumerical || curvature == Curvature::kPositive) throw;
    }
  }
}

StepReport FullDynamics::minimise(const Potential& potential, Eigen::VectorXd& w) {
  StepReport report;
  double now = value(potential, w);
  for (; report.newton_steps < options_.max_newton_steps; ++report.newton_steps) {
    const Eigen::VectorXd slope = gradient(potential, w);
    if (slope.isZero(0)) return report;
    factor(potential, w);
    Eigen::VectorXd step = -slope;
    cholesky_.solve_in_place(step);
    const double decrement2 = -slope.dot(step);
    const Eigen::VectorXd direction = dofs_.expand_rows(step);
    const double scale = potential.scale + elasticity_.value(w) +
                         direction.dot(mass_ * direction) / (potential.reach * potential.reach) +
                         std::abs(potential.force.dot(w - potential.begin));
    report.left = std::sqrt(std::max(0.0, decrement2) / scale);
    if (!std::isfinite(decrement2)) break;
    // The step is available: taking it squares the remaining error.
    if (report.left <= options_.tolerance || decrement2 <= kRounding * std::abs(now)) {
      w += direction;
      return report;
    }
    const Descent descent =
        backtrack({now, -decrement2}, {.max_trials = kLineSearchSteps},
                  [&](double part) { return value(potential, w + part * direction); });
    if (!descent.is_accepted) break;
    w += descent.step * direction;
    now = descent.value;
  }
  report.status = StepReport::Status::kNotConverged;
  return report;
}

StepReport FullDynamics::step(const Eigen::Ref<const Eigen::VectorXd>& force) {
  return step(force, options_.time_step);
}

StepReport FullDynamics::step(const Eigen::Ref<const Eigen::VectorXd>& force, double time_step) {
  LIMBER_DEMAND(force.size() == dofs_.full_count());
  const bool midpoint = options_.scheme == TimeStepping::kImplicitMidpoint;
  Potential potential;
  potential.reach = midpoint ? time_step / 2 : time_step;
  potential.begin = state_.displacement;
  potential.inertial = state_.displacement + potential.reach * state_.velocity;
  potential.force = dofs_.expand_rows(dofs_.restrict_rows(force));
  if (options_.relaxation_time > 0) {
    potential.memory = {elasticity_.strains(state_.displacement),
                        options_.relaxation_time / potential.reach};
  }
  potential.scale = kinetic_energy() + elastic_energy();
  Eigen::VectorXd w = potential.inertial;
  if (value(potential, potential.begin) < value(potential, w)) w = potential.begin;
  const StepReport report = minimise(potential, w);
  if (report.status != StepReport::Status::kConverged || !w.allFinite()) {
    return {StepReport::Status::kNotConverged, report.newton_steps, report.left};
  }
  const Eigen::VectorXd velocity = (w - potential.begin) / potential.reach;
  if (midpoint) {
    state_.displacement = 2 * w - potential.begin;
    state_.velocity = 2 * velocity - state_.velocity;
  } else {
    state_.displacement = w;
    state_.velocity = velocity;
  }
  return report;
}

}  // namespace limber::bodies
