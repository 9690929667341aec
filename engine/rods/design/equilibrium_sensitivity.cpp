#include "engine/rods/design/equilibrium_sensitivity.h"

#include <optional>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/holding.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/solver/bordered_solver.h"
#include "engine/rods/solver/condensed_solver.h"

namespace limber::rods {
namespace {

const Conditions& demand_unloaded(const LinkageModel& model, const Conditions& conditions) {
  conditions.validate(model);
  const auto refuse = [](const char* field) {
    throw Error(ErrorCode::kInvalidArgument, field,
                "designs are judged by equilibria without springs, loads and weight");
  };
  if (!conditions.springs.empty()) refuse("springs");
  if (!conditions.loads.empty()) refuse("loads");
  if (!conditions.gravity.acceleration.isZero(0) && conditions.gravity.mass_per_length != 0)
    refuse("gravity");
  return conditions;
}

}  // namespace

struct EquilibriumSensitivity::Impl {
  Impl(const LinkageModel& linkage, const LinkageState& shape, const Conditions& conditions,
       DesignVariables variables)
      : model(linkage),
        state(shape),
        map(linkage, variables),
        scales(linkage),
        terms(linkage, demand_unloaded(linkage, conditions)),
        holding(linkage, conditions, terms, scales, shape),
        solver(linkage.chains()),
        derivatives(linkage) {
    LinkageAssembly assembly(model);
    CondensedMatrix matrix(model.chains());
    Eigen::VectorXd gradient(model.variables().size());
    (void)assembly.hessian(state, gradient, matrix);
    solver.set_pinned(holding.pinned());
    solver.set_shift_weights(scales.weights());
    // A mechanism moves without effort: what it does to the shape is whatever rounding says.
    if (solver.factor(matrix).vanishing > 0) solver.factor(matrix, scales.rounding_shift());
    if (solver.pivots().vanishing > 0)
      throw Error(ErrorCode::kNumerical, "", "the equilibrium's Hessian is singular");
    bordered.emplace(solver, holding.rows(), Eigen::VectorXd::Zero(holding.rows().rows()));
  }

  /// A change of the variables with that of the shape.
  [[nodiscard]] LinkageVector both(const Eigen::VectorXd& way,
                                   const Eigen::VectorXd& change) const {
    LinkageVector result = map.direction(way);
    result.unknowns = change;
    return result;
  }

  [[nodiscard]] Eigen::VectorXd solve(Eigen::VectorXd b) {
    for (const int unknown : holding.pinned()) b[unknown] = 0;
    Eigen::VectorXd rows = Eigen::VectorXd::Zero(holding.rows().rows());
    bordered->solve_in_place(b, rows);
    return b;
  }

  const LinkageModel& model;
  LinkageState state;
  DesignVariableMap map;
  detail::UnknownScales scales;
  detail::ConditionTerms terms;
  detail::Holding holding;
  CondensedSolver solver;
  LinkageDerivatives derivatives;
  std::optional<BorderedSolver> bordered;
};

EquilibriumSensitivity::EquilibriumSensitivity(const LinkageModel& model, const LinkageState& state,
                                               const Conditions& conditions,
                                               DesignVariables variables)
    : impl_(std::make_unique<Impl>(model, state, conditions, variables)) {}
EquilibriumSensitivity::~EquilibriumSensitivity() = default;
EquilibriumSensitivity::EquilibriumSensitivity(EquilibriumSensitivity&&) noexcept = default;
EquilibriumSensitivity& EquilibriumSensitivity::operator=(EquilibriumSensitivity&&) noexcept =
    default;

const LinkageState& EquilibriumSensitivity::state() const { return impl_->state; }
bool EquilibriumSensitivity::is_minimum() const { return impl_->bordered->positive_definite(); }

Eigen::VectorXd EquilibriumSensitivity::shape_change(const Eigen::VectorXd& way) const {
  return impl_->solve(
      -impl_->derivatives.second({impl_->state}, impl_->map.direction(way)).unknowns);
}

Eigen::VectorXd EquilibriumSensitivity::shape_curvature(const Eigen::VectorXd& way,
                                                        const Eigen::VectorXd& change) const {
  const LinkageVector both = impl_->both(way, change);
  return impl_->solve(-impl_->derivatives.third({impl_->state}, both, both).unknowns);
}

EquilibriumSensitivity::Adjoint EquilibriumSensitivity::adjoint(ShapeFunction& function) const {
  LinkageVector direct = function.gradient(impl_->state);
  Adjoint result;
  result.multiplier = impl_->solve(std::move(direct.unknowns));
  result.gradient = impl_->map.gradient(direct) - impl_->map.gradient(impl_->derivatives.second(
                                                      {impl_->state}, {result.multiplier, {}}));
  return result;
}

Eigen::VectorXd EquilibriumSensitivity::product(ShapeFunction& function, const Adjoint& adjoint,
                                                const Eigen::VectorXd& way,
                                                const Eigen::VectorXd& change) const {
  const LinkageVector both = impl_->both(way, change);
  const LinkageVector direct = function.second(impl_->state, both);
  const LinkageVector bent =
      impl_->derivatives.third({impl_->state}, {adjoint.multiplier, {}}, both);
  const Eigen::VectorXd multiplier = impl_->solve(direct.unknowns - bent.unknowns);
  const LinkageVector held = impl_->derivatives.second({impl_->state}, {multiplier, {}});
  return impl_->map.gradient(direct) - impl_->map.gradient(bent) - impl_->map.gradient(held);
}

}  // namespace limber::rods
