#include "engine/rods/design/equilibrium_sensitivity.h"

#include <utility>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/holding.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/size_derivatives.h"

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
  Impl(const LinkageModel& linkage, const LinkageState& shape,
       const Conditions& equilibrium_conditions, DesignVariables variables,
       std::unique_ptr<HessianFactor> given)
      : model(linkage),
        state(&shape),
        conditions(demand_unloaded(linkage, equilibrium_conditions)),
        map(linkage, variables),
        derivatives(linkage),
        sizes(linkage),
        assembly(linkage),
        factor(std::move(given)) {
    if (!factor) make_factor();
  }

  /// Certifies as the solver of equilibria does.
  void make_factor() {
    if (!factor) factor = std::make_unique<HessianFactor>(model.chains());
    const detail::UnknownScales scales(model);
    const detail::ConditionTerms terms(model, conditions);
    const detail::Holding holding(model, conditions, terms, scales, *state);
    CondensedMatrix matrix(model.chains());
    factor->bordered.reset();
    factor->gradient.resize(model.variables().size());
    (void)assembly.hessian(*state, factor->gradient, matrix);
    CondensedSolver& solver = factor->solver;
    factor->fixed = holding.pinned();
    for (const int length : detail::lengths_on_their_bound(model, *state, factor->gradient,
                                                           conditions.shortest_joint_edge))
      factor->fixed.push_back(length);
    solver.set_pinned(factor->fixed);
    solver.set_shift_weights(scales.weights());
    factor->shift = 0;
    // A mechanism moves without effort: rounding determines its effect on the shape.
    if (solver.factor(matrix).vanishing > 0) {
      factor->shift = scales.rounding_shift();
      solver.factor(matrix, factor->shift);
    }
    if (solver.pivots().vanishing > 0)
      throw Error(ErrorCode::kNumerical, "", "the equilibrium's Hessian is singular");
    factor->border(holding.rows());
  }

  /// A change of the variables with that of the shape.
  [[nodiscard]] LinkageVector both(const Eigen::VectorXd& direction,
                                   const Eigen::VectorXd& change) const {
    LinkageVector result = map.direction(direction);
    result.unknowns = change;
    return result;
  }

  [[nodiscard]] Eigen::VectorXd solve(Eigen::VectorXd b) const {
    factor->solve_in_place(b);
    return b;
  }

  const LinkageModel& model;
  const LinkageState* state;
  Conditions conditions;
  DesignVariableMap map;
  LinkageDerivatives derivatives;
  SizeDerivatives sizes;
  LinkageAssembly assembly;
  std::unique_ptr<HessianFactor> factor;
};

EquilibriumSensitivity::EquilibriumSensitivity(const LinkageModel& model, const LinkageState& state,
                                               const Conditions& conditions,
                                               DesignVariables variables)
    : EquilibriumSensitivity(model, state, conditions, variables, nullptr) {}
EquilibriumSensitivity::EquilibriumSensitivity(const LinkageModel& model, const LinkageState& state,
                                               const Conditions& conditions,
                                               DesignVariables variables,
                                               std::unique_ptr<HessianFactor> factor)
    : impl_(std::make_unique<Impl>(model, state, conditions, variables, std::move(factor))) {}
EquilibriumSensitivity::~EquilibriumSensitivity() = default;
EquilibriumSensitivity::EquilibriumSensitivity(EquilibriumSensitivity&&) noexcept = default;
EquilibriumSensitivity& EquilibriumSensitivity::operator=(EquilibriumSensitivity&&) noexcept =
    default;

std::unique_ptr<HessianFactor> EquilibriumSensitivity::move_to(
    const LinkageState& state, std::unique_ptr<HessianFactor> factor) {
  LIMBER_DEMAND(factor != nullptr && factor->bordered);
  impl_->state = &state;
  std::swap(impl_->factor, factor);
  return factor;
}
void EquilibriumSensitivity::move_to(const LinkageState& state) {
  impl_->state = &state;
  impl_->make_factor();
}

const LinkageState& EquilibriumSensitivity::state() const { return *impl_->state; }
bool EquilibriumSensitivity::is_minimum() const {
  return impl_->factor->bordered->positive_definite();
}

Eigen::VectorXd EquilibriumSensitivity::shape_change(const Eigen::VectorXd& direction) const {
  Eigen::VectorXd change(impl_->model.variables().size());
  impl_->assembly.gradient_change(*impl_->state, impl_->map.direction(-direction), change);
  impl_->factor->solve_in_place(change);
  return change;
}

Eigen::VectorXd EquilibriumSensitivity::shape_curvature(const Eigen::VectorXd& direction,
                                                        const Eigen::VectorXd& change) const {
  const LinkageVector both = impl_->both(direction, change);
  return impl_->solve(-impl_->derivatives.third({*impl_->state}, both, both).unknowns);
}

EquilibriumSensitivity::Adjoint EquilibriumSensitivity::adjoint(ShapeFunction& function) const {
  const double share = function.elastic_share();
  Adjoint result;
  // Reactions balance dE/dx: the solve leaves of it as much as the tolerance did.
  result.multiplier = share * impl_->factor->gradient;
  function.add_gradient(*impl_->state, 1, result.multiplier);
  impl_->factor->solve_in_place(result.multiplier);
  result.gradient =
      -impl_->map.gradient(impl_->sizes.evaluate(*impl_->state, -share, result.multiplier));
  return result;
}

EquilibriumSensitivity::Adjoint EquilibriumSensitivity::elastic_adjoint() const {
  return {impl_->map.gradient(impl_->sizes.evaluate(*impl_->state, 1)), {}};
}

Eigen::VectorXd EquilibriumSensitivity::product(ShapeFunction& function, const Adjoint& adjoint,
                                                const Eigen::VectorXd& direction,
                                                const Eigen::VectorXd& change) const {
  if (adjoint.multiplier.size() == 0) {
    // The remaining forces of D^2 E are those of the constraints on the shape.
    return function.elastic_share() * impl_->map.gradient(impl_->derivatives.second(
                                          {*impl_->state}, impl_->both(direction, change)));
  }
  // The share of D^2 E and -D^3 E [w], negated.
  const LinkageVector bent =
      impl_->derivatives.third({*impl_->state}, {adjoint.multiplier, {}},
                               impl_->both(direction, change), -function.elastic_share());
  Eigen::VectorXd multiplier = -bent.unknowns;
  function.add_second(*impl_->state, change, 1, multiplier);
  impl_->factor->solve_in_place(multiplier);
  return -impl_->map.gradient(bent) -
         impl_->map.gradient(impl_->sizes.evaluate(*impl_->state, 0, multiplier));
}

}  // namespace limber::rods
