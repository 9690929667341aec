#include "engine/rods/design/linkage_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/design/cell_area.h"
#include "engine/rods/design/equilibrium_sensitivity.h"
#include "engine/rods/design/kept_factors.h"
#include "engine/rods/equilibrium/unknown_scales.h"

namespace limber::rods {
namespace {

/// Share of the energy that bends a linkage by an angle of one: smaller energies mean nothing, as
/// of bends of 1e-6.
constexpr double kNoStress = 1e-12;
/// Tolerance of equilibria whose imbalance may go into gradients of energies to first order.
constexpr double kBalanced = 1e-9;

template <class Call>
void with_prefix(const char* prefix, const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    throw Error(error.code(), prefix + error.field(), error.what());
  }
}

}  // namespace

bool is_without_stress(const LinkageModel& model, const LinkageState& state) {
  const detail::UnknownScales scales(model);
  const double bending = scales.bending() / scales.extent();
  const double rounding = scales.energy_rounding(scales.beyond(state));
  return !(ElasticEnergy(model).value(state) > std::max(rounding, kNoStress * bending));
}

struct LinkageDesign::Impl {
  /// Members that depend on the criteria.
  struct Measures {
    Measures(const LinkageModel& model, ElasticEnergy& energy, const DesignCriteria& criteria)
        : flatness(model, criteria.plane),
          angle(model, criteria.angle_sharpness),
          area(model),
          distance(model, criteria.targets, criteria.surface.get(), criteria.surface_weight,
                   criteria.joint_surface_weights),
          flat(energy),
          flat_weight(criteria.flat_share / criteria.energy_scale),
          deployed({{(1 - criteria.flat_share) / criteria.energy_scale, energy},
                    {criteria.distance_weight / std::pow(criteria.length_scale, 2), distance}}) {}
    Flatness flatness;
    SmallestAngle angle;
    CellArea area;
    TargetDistance distance;
    ElasticEnergy& flat;  // times its weight it is the flat shape's part of J
    double flat_weight;
    SumOfFunctions deployed;  // the other shape's part
  };
  /// At the present point: derivatives of its shapes, and the results requested so far.
  struct Derivatives {
    using Adjoint = EquilibriumSensitivity::Adjoint;
    EquilibriumSensitivity flat, deployed;
    std::optional<Adjoint> flat_part = {}, deployed_part = {};  // both or none
    std::optional<Adjoint> flatness = {}, angle = {};           // both or none
    std::optional<Adjoint> area = {};  // with them, where areas are bounded
    DesignMeasures<Eigen::VectorXd> gradients = {};

    void forget() {
      flat_part.reset();
      deployed_part.reset();
      flatness.reset();
      angle.reset();
      area.reset();
      gradients = {};
    }
  };

  /// The model has other sizes for a while, no longer than this lives.
  struct OwnSizes {
    explicit OwnSizes(Impl& owner) : impl(owner) {}
    ~OwnSizes() { set_sizes(impl.model, impl.point); }
    OwnSizes(const OwnSizes&) = delete;
    OwnSizes& operator=(const OwnSizes&) = delete;
    Impl& impl;
  };

  Impl(const LinkageModel& linkage, Conditions flat_conditions, Conditions deployed_conditions,
       DesignPoint start, DesignCriteria initial_criteria, DesignLimits limit,
       DesignVariables variables)
      : model(linkage),
        flat(std::move(flat_conditions)),
        deployed(std::move(deployed_conditions)),
        limits(limit),
        equilibrium(model),
        scales(model),
        energy(model),
        map(model, variables),
        criteria(std::move(initial_criteria)),
        point(std::move(start)) {
    criteria.validate();
    limits.validate();
    with_prefix("flat.", [&] { flat.validate(model); });
    with_prefix("deployed.", [&] { deployed.validate(model); });
    place_start();
    detail::KeptFactors::Pair kept;
    kept.flat = settle("flat", point.flat, flat);
    kept.deployed = settle("deployed", point.deployed, deployed);
    factors.keep(point, std::move(kept));
    if (criteria.energy_scale == 0) criteria.energy_scale = start_energy();
    if (criteria.length_scale == 0) criteria.length_scale = scales.extent();
    measures.emplace(model, energy, criteria);
  }

  void place_start() {
    if (map.which().lengths == LengthVariables::kSegments && point.edges.size() > 0) {
      throw Error(ErrorCode::kInvalidArgument, "start.edges",
                  "must be empty where the lengths of segments are varied");
    }
    with_prefix("start.", [&] { set_sizes(model, point); });
    parameters = map.values(model);
    point.lengths = model.segment_lengths();
    map.place(model, parameters, point);
  }

  /// Energy of the deployed shape; if that is nothing, the energy that bends the whole linkage by
  /// an angle of one.
  [[nodiscard]] double start_energy() {
    if (is_without_stress(model, point.deployed)) return scales.bending() / scales.extent();
    return energy.value(point.deployed);
  }

  std::unique_ptr<HessianFactor> settle(const char* which, LinkageState& state,
                                        const Conditions& conditions) {
    const EquilibriumReport report = equilibrium.solve(state, conditions, limits.equilibrium);
    if (report.converged()) return take_factor();
    throw Error(ErrorCode::kFailedPrecondition, fmt::format("start.{}", which),
                fmt::format("is no equilibrium, and none was found: {}", report.message));
  }

  std::unique_ptr<HessianFactor> take_factor() {
    std::unique_ptr<HessianFactor> spare = factors.spare();
    std::unique_ptr<HessianFactor> taken = equilibrium.take_factor(std::move(spare));
    factors.give_back(std::move(spare));  // where it was of no use
    return taken;
  }

  /// Both shapes at the present point.
  Derivatives& shapes() {
    if (there) return *derivatives;
    detail::KeptFactors::Pair kept = factors.take(model, point);
    factored_anew += (kept.flat ? 0 : 1) + (kept.deployed ? 0 : 1);
    if (!derivatives) {
      derivatives.emplace(
          Derivatives{{model, point.flat, flat, map.which(), std::move(kept.flat)},
                      {model, point.deployed, deployed, map.which(), std::move(kept.deployed)}});
    } else {
      move(derivatives->flat, point.flat, std::move(kept.flat));
      move(derivatives->deployed, point.deployed, std::move(kept.deployed));
    }
    derivatives->forget();
    there = true;
    return *derivatives;
  }
  void move(EquilibriumSensitivity& shape, const LinkageState& state,
            std::unique_ptr<HessianFactor> factor) {
    if (factor) {
      factors.give_back(shape.move_to(state, std::move(factor)));
    } else {
      shape.move_to(state);
    }
  }

  Derivatives& objective_gradient() {
    Derivatives& here = shapes();
    if (here.flat_part) return here;
    here.deployed_part = here.deployed.adjoint(measures->deployed);
    here.flat_part = energy_adjoint(here.flat);
    here.gradients.flat_energy = here.flat_part->gradient;
    here.gradients.objective =
        measures->flat_weight * here.flat_part->gradient + here.deployed_part->gradient;
    return here;
  }
  /// For the flat shape's energy.
  [[nodiscard]] Derivatives::Adjoint energy_adjoint(const EquilibriumSensitivity& shape) {
    return limits.equilibrium.tolerance <= kBalanced ? shape.elastic_adjoint()
                                                     : shape.adjoint(measures->flat);
  }
  Derivatives& all_gradients() {
    Derivatives& here = objective_gradient();
    if (here.flatness) return here;
    here.flatness = here.flat.adjoint(measures->flatness);
    here.angle = here.flat.adjoint(measures->angle);
    if (criteria.least_area > 0) here.area = here.deployed.adjoint(measures->area);
    here.gradients.flatness = here.flatness->gradient;
    here.gradients.smallest_angle = here.angle->gradient;
    here.gradients.deployed_area =
        here.area ? here.area->gradient : Eigen::VectorXd::Zero(parameters.size());
    return here;
  }
  Derivatives& gradients(Which which) {
    return which == Which::kAll ? all_gradients() : objective_gradient();
  }

  /// Predicted motion of an equilibrium when lengths change in a direction.
  struct Forecast {
    Eigen::VectorXd move;    // of the unknowns
    Eigen::VectorXd linear;  // the same to first order
    double turned = 0;       // by it [rad]
    bool diverges = false;
  };
  Forecast forecast(const EquilibriumSensitivity& at, const Eigen::VectorXd& direction) {
    Forecast result{at.shape_change(direction), {}, 0, false};
    result.linear = result.move;
    const double first = scales.largest_turn(model, at.state(), result.move);
    if (limits.predictor == PredictorOrder::kSecond && first > 0) {
      const Eigen::VectorXd bend = 0.5 * at.shape_curvature(direction, result.move);
      // Near a fold the path turns round within the step: no polynomial predicts it.
      result.diverges = !(scales.largest_turn(model, at.state(), bend) <= first);
      result.move += bend;
    }
    result.turned = scales.largest_turn(model, at.state(), result.move);
    return result;
  }

  /// One equilibrium with the model's present lengths, from where the state is.
  TrialStatus solve(const Conditions& conditions, const JobContext& context, LinkageState& state,
                    DesignTrial& trial, EquilibriumReport& report) {
    report = equilibrium.solve(state, conditions, limits.equilibrium, context);
    trial.iterations += report.iterations;
    trial.message = report.message;
    if (report.status == EquilibriumStatus::kCancelled) return TrialStatus::kCancelled;
    return report.converged() ? TrialStatus::kFound : TrialStatus::kLost;
  }

  /// The same, wherever it lies.
  TrialStatus fall(const Conditions& conditions, const JobContext& context, LinkageState& state,
                   DesignTrial& trial, std::unique_ptr<HessianFactor>& factor) {
    EquilibriumReport report;
    const TrialStatus status = solve(conditions, context, state, trial, report);
    if (status == TrialStatus::kFound) factor = take_factor();
    return status;
  }

  /// The same from a prediction, and near it.
  TrialStatus follow(const Forecast& to, const Conditions& conditions, const JobContext& context,
                     LinkageState& state, DesignTrial& trial,
                     std::unique_ptr<HessianFactor>& factor) {
    if (to.diverges || !(to.turned <= limits.largest_move)) {
      trial.message = to.diverges ? "the equilibrium path turns too sharply for prediction"
                                  : "the shape would move too far in one step";
      return TrialStatus::kTooFar;
    }
    equilibrium.expect_step(state, to.linear);
    state = state.moved(model, to.move);
    EquilibriumReport report;
    const TrialStatus status = solve(conditions, context, state, trial, report);
    trial.surprise = std::max(trial.surprise, report.turned);
    if (status != TrialStatus::kFound) return status;
    const double surprise =
        std::min(limits.largest_surprise,
                 std::max(limits.small_surprise, limits.surprise_share * to.turned));
    if (report.turned > surprise || report.escapes > 0) {
      trial.message =
          report.escapes > 0
              ? "the predicted shape is no longer stable"
              : fmt::format(
                    "the structure jumped: the nearest equilibrium is {:.1f} degrees from "
                    "its prediction",
                    report.turned * kDegreesPerRadian);
      return TrialStatus::kJumped;
    }
    factor = take_factor();
    return TrialStatus::kFound;
  }

  LinkageModel model;
  Conditions flat, deployed;
  DesignLimits limits;
  LinkageEquilibrium equilibrium;
  detail::UnknownScales scales;
  ElasticEnergy energy;
  DesignVariableMap map;
  DesignCriteria criteria;
  DesignPoint point;
  Eigen::VectorXd parameters;  // of it
  std::optional<Measures> measures;
  detail::KeptFactors factors;
  std::optional<Derivatives> derivatives;  // empty until they are requested
  bool there = false;                      // are they at the point
  int factored_anew = 0, criteria_revision = 0;
};

LinkageDesign::LinkageDesign(const LinkageModel& model, Conditions flat, Conditions deployed,
                             DesignPoint start, DesignCriteria criteria, DesignLimits limits,
                             DesignVariables variables)
    : impl_(std::make_unique<Impl>(model, std::move(flat), std::move(deployed), std::move(start),
                                   std::move(criteria), limits, variables)) {}
LinkageDesign::~LinkageDesign() = default;
LinkageDesign::LinkageDesign(LinkageDesign&&) noexcept = default;
LinkageDesign& LinkageDesign::operator=(LinkageDesign&&) noexcept = default;

const LinkageModel& LinkageDesign::model() const { return impl_->model; }
const Conditions& LinkageDesign::flat() const { return impl_->flat; }
const Conditions& LinkageDesign::deployed() const { return impl_->deployed; }
const DesignPoint& LinkageDesign::point() const { return impl_->point; }
const DesignCriteria& LinkageDesign::criteria() const { return impl_->criteria; }

const DesignVariableMap& LinkageDesign::variables() const { return impl_->map; }
const Eigen::VectorXd& LinkageDesign::parameters() const { return impl_->parameters; }

DesignTrial LinkageDesign::trial(const Eigen::VectorXd& parameters, const JobContext& context,
                                 Landing landing) {
  DesignTrial trial{TrialStatus::kFound, impl_->point, 0, {}, 0, LostShape::kNone};
  Impl::Derivatives& here = impl_->shapes();
  const Eigen::VectorXd direction = parameters - impl_->parameters;
  const Impl::Forecast flat = impl_->forecast(here.flat, direction);
  const Impl::Forecast deployed = impl_->forecast(here.deployed, direction);
  const Impl::OwnSizes own_sizes(*impl_);  // again, however this ends
  try {
    impl_->map.place(impl_->model, parameters, trial.point);
    set_sizes(impl_->model, trial.point);
  } catch (const Error& error) {  // e.g. nothing would be left between a segment's joints
    trial.status = TrialStatus::kTooFar;
    trial.message = error.what();
    return trial;
  }
  detail::KeptFactors::Pair made;
  trial.status = impl_->follow(flat, impl_->flat, context, trial.point.flat, trial, made.flat);
  if (trial.status != TrialStatus::kFound) trial.lost = LostShape::kFlat;
  if (trial.status == TrialStatus::kFound) {
    LinkageState& state = trial.point.deployed;
    trial.status =
        landing == Landing::kPredicted
            ? impl_->follow(deployed, impl_->deployed, context, state, trial, made.deployed)
            : impl_->fall(impl_->deployed, context, state, trial, made.deployed);
    if (trial.status != TrialStatus::kFound) trial.lost = LostShape::kDeployed;
  }
  impl_->factors.keep(trial.point, std::move(made));
  return trial;
}

DesignValues LinkageDesign::values(const DesignPoint& point) {
  Impl::Measures& measures = *impl_->measures;
  const Impl::OwnSizes own_sizes(*impl_);
  set_sizes(impl_->model, point);
  DesignValues values;
  values.flat_energy = impl_->energy.value(point.flat);
  values.deployed_energy = impl_->energy.value(point.deployed);
  values.distance = measures.distance.value(point.deployed);
  values.flatness = measures.flatness.value(point.flat);
  values.smallest_angle = measures.angle.value(point.flat);
  values.deployed_area = measures.area.value(point.deployed);
  values.objective =
      measures.flat_weight * values.flat_energy + measures.deployed.value(point.deployed);
  return values;
}

void LinkageDesign::move_to(DesignPoint point) {
  set_sizes(impl_->model, point);
  impl_->parameters = impl_->map.values(impl_->model);
  impl_->point = std::move(point);
  impl_->there = false;
}

void LinkageDesign::set_criteria(DesignCriteria criteria) {
  criteria.validate();
  if (criteria.energy_scale == 0) criteria.energy_scale = impl_->criteria.energy_scale;
  if (criteria.length_scale == 0) criteria.length_scale = impl_->criteria.length_scale;
  const Impl::Measures checked(impl_->model, impl_->energy, criteria);  // throws before any change
  if (impl_->there) impl_->derivatives->forget();
  impl_->criteria = std::move(criteria);
  impl_->measures.emplace(impl_->model, impl_->energy, impl_->criteria);
  ++impl_->criteria_revision;
}

int LinkageDesign::criteria_revision() const { return impl_->criteria_revision; }

const DesignMeasures<Eigen::VectorXd>& LinkageDesign::gradients(Which which) {
  return impl_->gradients(which).gradients;
}

int LinkageDesign::factored_anew() const { return impl_->factored_anew; }

DesignMeasures<Eigen::VectorXd> LinkageDesign::products(const Eigen::VectorXd& direction,
                                                        Which which) {
  Impl::Derivatives& here = impl_->gradients(which);
  Impl::Measures& measures = *impl_->measures;
  const Eigen::VectorXd flat = here.flat.shape_change(direction);
  DesignMeasures<Eigen::VectorXd> result;
  result.flat_energy = here.flat.product(measures.flat, *here.flat_part, direction, flat);
  const Eigen::VectorXd deployed = here.deployed.shape_change(direction);
  result.objective =
      here.deployed.product(measures.deployed, *here.deployed_part, direction, deployed) +
      measures.flat_weight * result.flat_energy;
  if (which == Which::kObjective) return result;
  result.flatness = here.flat.product(measures.flatness, *here.flatness, direction, flat);
  result.smallest_angle = here.flat.product(measures.angle, *here.angle, direction, flat);
  result.deployed_area = here.area
                             ? here.deployed.product(measures.area, *here.area, direction, deployed)
                             : Eigen::VectorXd::Zero(direction.size());
  return result;
}

}  // namespace limber::rods
