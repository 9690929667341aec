#include "engine/spacetime/material_solver.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/numerics/line_search.h"
#include "engine/spacetime/fit_dynamics.h"
#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/material_step.h"

namespace limber::spacetime {
namespace {

constexpr double kFirstDamping = 1;  // Levenberg's nu
constexpr double kLeastDamping = 1e-9, kStiffDamping = 1e4;
/// A motion that gains less than this part of the energy is as good as it was.
constexpr double kSettled = 1e-6;
constexpr double kLeastPart = 1e-6;  // of a step, before it counts as none
constexpr std::size_t kWindow = 10;  // steps that the tolerance looks back
/// An energy of this part of that at rest is none.
constexpr double kNoEnergy = 1e-12;
/// A mode that moves less than this part of the largest one tells nothing of its dynamics.
constexpr double kAtRest = 1e-9;

[[noreturn]] void refuse_material(const char* field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

void validate(const reduced::Kinematics& kinematics, const Timeline& timeline,
              const Material& material, const Eigen::MatrixXd& motion,
              const MaterialOptions& options) {
  options.validate();
  const int modes = material.modes();
  if (material.coordinates() != kinematics.coordinate_count()) {
    refuse_material("material.mixing",
                    fmt::format("material.mixing has {} rows, the kinematics {} coordinates",
                                material.coordinates(), kinematics.coordinate_count()));
  }
  if (modes > material.coordinates()) {
    refuse_material("material.mixing",
                    fmt::format("material.mixing mixes {} coordinates into {} modes: "
                                "there cannot be more modes than coordinates",
                                material.coordinates(), modes));
  }
  const ModeDynamics& dynamics = material.dynamics;
  if (dynamics.stiffness.size() != modes || dynamics.damping.size() != modes) {
    refuse_material(
        "material.dynamics",
        fmt::format("material.dynamics has {} stiffnesses and {} dampings, there are {} modes",
                    dynamics.stiffness.size(), dynamics.damping.size(), modes));
  }
  const auto bad = [](const Eigen::VectorXd& values) {
    return !values.allFinite() || (values.array() < 0).any();
  };
  if (bad(dynamics.stiffness) || bad(dynamics.damping))
    refuse_material("material.dynamics", "material.dynamics must be finite and >= 0");
  if (!is_discretisation(dynamics.discretisation) || !is_smoothing(dynamics.smoothing) ||
      !are_force_weights(dynamics))
    refuse_material("material.dynamics",
                    "material.dynamics must have a discretisation and a smoothing in [0, 1e6]");
  if (!material.mixing.allFinite())
    refuse_material("material.mixing", "material.mixing must be finite");
  if (motion.rows() != modes || motion.cols() != timeline.frame_count || !motion.allFinite()) {
    refuse_material("motion", fmt::format("motion must be {} x {} finite values, is {} x {}", modes,
                                          timeline.frame_count, motion.rows(), motion.cols()));
  }
  if (options.held > modes)
    refuse_material("options.held",
                    fmt::format("options.held = {} must be <= {} modes", options.held, modes));
}

}  // namespace

class MaterialSolver::Impl {
 public:
  Impl(std::shared_ptr<const reduced::Kinematics> kinematics, const Timeline& timeline,
       const ConstraintSet& constraints, Material material, const Eigen::MatrixXd& motion,
       MaterialOptions options)
      : options_(options),
        kinematics_(std::move(kinematics)),
        constraints_(constraints),
        timeline_(timeline),
        material_(std::move(material)),
        systems_(material_.dynamics, timeline_),
        rows_(kinematics_, {}, material_.coordinates()) {
    rows_.rebuild(constraints, systems_.frames());
    if (rows_.term_count() > kMaxRows) {
      throw Error(ErrorCode::kLimitExceeded, "constraints",
                  fmt::format("material optimisation takes constraints of at most {} axes together,"
                              " those of velocities counted twice; these have {}",
                              kMaxRows, rows_.term_count()));
    }
    systems_.set_knots(rows_.knots());
    systems_.gather(motion, point_.z);
    point_.mixing = material_.mixing;
    evaluate(point_);
    energy_ = merit(point_, systems_);
  }

  MaterialReport solve(const JobContext& job,
                       const std::function<bool(const MaterialReport&)>& on_step);
  const Eigen::MatrixXd& motion() {
    systems_.interpolate(point_.z, motion_);
    return motion_;
  }

  [[nodiscard]] const Material& material() const { return material_; }
  [[nodiscard]] const reduced::Kinematics& kinematics() const { return *kinematics_; }
  [[nodiscard]] const Timeline& timeline() const { return timeline_; }
  [[nodiscard]] const MaterialOptions& options() const { return options_; }
  void resume(const Material& material, const Eigen::MatrixXd& motion) {
    resumed_.emplace(material, motion);
  }

 private:
  void evaluate(MaterialPoint& point) {
    const auto knots = static_cast<Eigen::Index>(rows_.knots().size());
    hat_.setZero(padded_lanes(material_.coordinates()), knots);
    knots_z_.resize(systems_.modes(), knots);
    for (Eigen::Index knot = 0; knot < knots; ++knot) {
      knots_z_.col(knot) =
          point.z.col(systems_.kept_of_knot(static_cast<int>(knot))).head(systems_.modes());
    }
    hat_.topRows(material_.coordinates()).noalias() = point.mixing * knots_z_;
    rows_.evaluate(hat_, ConstraintRows::Jacobian::kYes, point.rows);
    ++evaluations_;
  }
  [[nodiscard]] double merit(const MaterialPoint& point, const ModeSystems& systems) const {
    return systems.energy(point.z) + rows_.merit(point.rows.residual) +
           options_.column_weight * column_energy(point.mixing);
  }
  /// energy_ with exact rows weighted and without their multipliers, which change from step to
  /// step.
  [[nodiscard]] double total_energy() const;
  /// Frequencies above this [1/frame] are lowered to it, those of later fits do not exceed it.
  /// Damping ratios of sampled modes are brought into their bounds.
  void bound_frequencies(double frequency);
  [[nodiscard]] FitOptions fit_options() const {
    FitOptions options{material_.dynamics.discretisation, material_.dynamics.smoothing};
    options.max_stiffness = max_stiffness_;
    options.beginning = beginning_of(timeline_);
    return options;
  }
  void set_dynamics(ModeDynamics dynamics);
  void fit_dynamics();
  [[nodiscard]] bool step();
  /// trial_ <- this part of step_, bettered by what the rows did that the step did not foresee
  /// (second-order correction, NOTATION.md). @returns its merit
  double try_step(double part);
  void accept(double part);
  /// By options_.limit; 0 where there is none.
  [[nodiscard]] double size_of(const ModeSystems& systems, const MaterialPoint& point);
  /// The size that this finds is kept for the point's acceptance.
  [[nodiscard]] bool is_within_limit(const ModeSystems& systems, const MaterialPoint& point) {
    found_size_ = size_of(systems, point);
    return !options_.limit.size || found_size_ <= std::max(size_, options_.limit.most);
  }
  /// z alone to its optimum for the present material. @returns whether it was worth it
  [[nodiscard]] bool settle_motion();
  [[nodiscard]] MaterialReport report(SolveStatus status, int iterations);

  /// State at the start of a solve, to restore it.
  struct Start {
    Material material;
    ModeSystems systems;
    MaterialPoint point;
    Eigen::VectorXd multiplier;
    double nu, energy, total;
  };
  void restore(const Start& start);
  void apply_resumed();
  /// The end of a solve: the start where that is lower.
  [[nodiscard]] MaterialReport finish(SolveStatus status, int iterations, const Start& start);

  MaterialOptions options_;
  std::shared_ptr<const reduced::Kinematics> kinematics_;
  ConstraintSet constraints_;
  Timeline timeline_;
  Material material_;
  ModeSystems systems_;
  ConstraintRows rows_;  // in z-hat = S z
  MaterialSpace space_;
  MaterialStep step_, correction_;
  MaterialPoint point_, trial_, candidate_;
  Lanes hat_;
  Eigen::MatrixXd knots_z_, motion_;
  double nu_ = kFirstDamping, energy_ = 0, start_total_ = 0;
  double max_stiffness_ = std::numeric_limits<double>::infinity();
  double size_ = 0, found_size_ = 0;  // of point_ and of the one looked at last, by options_.limit
  std::optional<std::pair<Material, Eigen::MatrixXd>> resumed_;
  int evaluations_ = 0;
};

double MaterialSolver::Impl::total_energy() const {
  const Eigen::VectorXd& residual = point_.rows.residual;
  double exact = 0;
  for (int row = 0; row < rows_.count(); ++row) {
    if (rows_.exact(row)) exact += rows_.weight()[row] * residual[row] * residual[row];
  }
  return systems_.energy(point_.z) + rows_.soft_energy(residual) + 0.5 * exact +
         options_.column_weight * column_energy(point_.mixing);
}

void MaterialSolver::Impl::set_dynamics(ModeDynamics dynamics) {
  material_.dynamics = std::move(dynamics);
  systems_ = ModeSystems(material_.dynamics, timeline_);
  systems_.set_knots(rows_.knots());
  energy_ = merit(point_, systems_);
  size_ = size_of(systems_, point_);
}

double MaterialSolver::Impl::size_of(const ModeSystems& systems, const MaterialPoint& point) {
  if (!options_.limit.size) return 0;
  systems.interpolate(point.z, motion_);
  return options_.limit.size(point.mixing, motion_);
}

void MaterialSolver::Impl::bound_frequencies(double frequency) {
  ModeDynamics bounded = material_.dynamics;
  max_stiffness_ = stiffness_of(frequency, bounded.discretisation);
  bool changed = false;
  for (Eigen::Index k = options_.held; k < bounded.stiffness.size(); ++k) {
    const ModeFit given{bounded.stiffness[k], bounded.damping[k]};
    const ModeFit inside = bounded_fit(given, fit_options());
    changed |= inside.stiffness != given.stiffness || inside.damping != given.damping;
    bounded.stiffness[k] = inside.stiffness;
    bounded.damping[k] = inside.damping;
  }
  if (changed) set_dynamics(std::move(bounded));
}

void MaterialSolver::Impl::fit_dynamics() {
  systems_.interpolate(point_.z, motion_);
  const double still = kAtRest * motion_.cwiseAbs().maxCoeff();
  ModeDynamics fitted = material_.dynamics;
  for (Eigen::Index k = options_.held; k < motion_.rows(); ++k) {
    if (!(motion_.row(k).cwiseAbs().maxCoeff() > still)) continue;
    FitOptions options = fit_options();
    options.known = {fitted.stiffness[k], fitted.damping[k]};
    const ModeFit fit = fit_mode(motion_.row(k), options);
    fitted.stiffness[k] = fit.stiffness;
    fitted.damping[k] = fit.damping;
  }
  ModeSystems systems(fitted, timeline_);
  systems.set_knots(rows_.knots());
  // Frames between knots follow the new dynamics: the energy falls. It may not where a free end's
  // last frames are held (NOTATION.md).
  const double energy = merit(point_, systems);
  if (!(energy <= energy_) || !is_within_limit(systems, point_)) return;
  systems_ = std::move(systems);
  material_.dynamics = std::move(fitted);
  energy_ = energy;
  size_ = found_size_;
}

bool MaterialSolver::Impl::step() {
  const bool with_mixing = options_.variables == MaterialVariables::kAll;
  bool settled = false;
  for (double part = 1; part > kLeastPart;) {
    const double nu = with_mixing ? nu_ : std::numeric_limits<double>::infinity();
    if (part == 1)
      space_.step(systems_, rows_, point_, {nu, options_.column_weight, options_.held}, step_);
    if (!(step_.promise > 0)) return settled;
    const double energy = try_step(part);
    const double gain = (energy_ - energy) / step_.promise;
    if (gain > kArmijoShare * part && is_within_limit(systems_, trial_)) {
      if (gain > 0.5) nu_ = std::max(kLeastDamping, nu_ / 3);
      if (gain < 0.1 && part == 1) nu_ *= 2;
      energy_ = energy;
      accept(part);
      return true;
    }
    if (with_mixing && nu_ < kStiffDamping) {
      nu_ *= 4;
      continue;
    }
    // nu holds S only: where the linear model does not reach as far as z wants to go, z goes alone,
    // by the means of its own solver.
    if (part == 1 && !settled && settle_motion()) {
      settled = true;
      nu_ = kFirstDamping;
      continue;
    }
    if (settled) return true;
    part *= 0.25;
  }
  return settled;
}

bool MaterialSolver::Impl::settle_motion() {
  Solver solver(kinematics_, material_.dynamics, timeline_, {}, point_.mixing);
  for (const auto& [id, constraint] : constraints_.positions) solver.add(constraint);
  for (const auto& [id, keyframe] : constraints_.keyframes) solver.add_keyframe(keyframe);
  solver.warm_start(motion(), Known::kAnswer);
  solver.solve();
  systems_.gather(solver.motion(), trial_.z);
  trial_.mixing = point_.mixing;
  evaluate(trial_);
  const double energy = merit(trial_, systems_);
  if (!(energy < energy_ - kSettled * energy_) || !is_within_limit(systems_, trial_)) return false;
  std::swap(point_, trial_);
  energy_ = energy;
  size_ = found_size_;
  return true;
}

double MaterialSolver::Impl::try_step(double part) {
  trial_.z = point_.z + part * step_.z;
  trial_.mixing = point_.mixing + part * step_.mixing;
  evaluate(trial_);
  double energy = merit(trial_, systems_);
  const Eigen::VectorXd foreseen =
      (1 - part) * point_.rows.residual +
      part * (step_.m - rows_.multiplier()).cwiseQuotient(rows_.weight());
  for (int round = 0; round < 3 && energy_ - energy < 0.25 * part * step_.promise; ++round) {
    if (!trial_.rows.residual.allFinite()) break;
    space_.correct(systems_, rows_, trial_.rows.residual - foreseen, correction_);
    candidate_.z = trial_.z + correction_.z;
    candidate_.mixing = trial_.mixing + correction_.mixing;
    evaluate(candidate_);
    const double now = merit(candidate_, systems_);
    if (!(now < energy)) break;
    energy = now;
    std::swap(trial_, candidate_);
  }
  return energy;
}

void MaterialSolver::Impl::accept(double part) {
  std::swap(point_, trial_);
  material_.mixing = point_.mixing;
  size_ = found_size_;
  if (rows_.exact_count() == 0) return;
  rows_.set_multipliers(rows_.multiplier() + part * (step_.m - rows_.multiplier()));
  energy_ = merit(point_, systems_);
}

void MaterialSolver::Impl::restore(const Start& start) {
  material_ = start.material;
  systems_ = start.systems;
  point_ = start.point;
  rows_.set_multipliers(start.multiplier);
  nu_ = start.nu;
  energy_ = start.energy;
  size_ = size_of(systems_, point_);
}

void MaterialSolver::Impl::apply_resumed() {
  if (!resumed_) return;
  const auto [material, motion] = *std::exchange(resumed_, std::nullopt);
  material_.mixing = point_.mixing = material.mixing;
  set_dynamics(material.dynamics);
  systems_.gather(motion, point_.z);
  evaluate(point_);
  energy_ = merit(point_, systems_);
}

MaterialReport MaterialSolver::Impl::solve(
    const JobContext& job, const std::function<bool(const MaterialReport&)>& on_step) {
  start_total_ = total_energy();
  size_ = size_of(systems_, point_);
  if (rows_.count() == 0) return report(SolveStatus::kConverged, 0);
  const Start start{material_, systems_, point_, rows_.multiplier(), nu_, energy_, start_total_};
  apply_resumed();
  const bool fits_dynamics = options_.variables != MaterialVariables::kMotion;
  bool slow = fits_dynamics && options_.slow_steps > 0;
  const bool may_be_settled = !slow;
  if (slow) bound_frequencies(std::min(options_.slow_frequency, options_.max_frequency));
  if (fits_dynamics && !slow) bound_frequencies(options_.max_frequency);
  std::vector<double> energies{energy_};  // with the bound of now
  const auto end_slow_steps = [&] {
    slow = false;
    bound_frequencies(options_.max_frequency);
    energies = {energy_};
  };
  for (int iteration = 0; iteration < options_.max_iterations;) {
    if (job.cancellation.requested()) return finish(SolveStatus::kCancelled, iteration, start);
    if (slow && iteration >= options_.slow_steps) end_slow_steps();
    if (fits_dynamics) fit_dynamics();
    if (!step()) {
      if (slow) {
        end_slow_steps();
        continue;
      }
      // Nothing is left to gain but what rounding hides.
      const double worth = energy_ + kNoEnergy * rows_.rest_energy();
      const bool done = !(step_.promise > options_.tolerance * worth);
      return finish(done ? SolveStatus::kConverged : SolveStatus::kStalled, iteration, start);
    }
    ++iteration;
    energies.push_back(energy_);
    if (!slow && energies.size() > kWindow &&
        energies[energies.size() - 1 - kWindow] - energy_ <=
            options_.tolerance * (energy_ + kNoEnergy * rows_.rest_energy())) {
      if (may_be_settled && iteration == kWindow) restore(start);
      return finish(SolveStatus::kConverged, iteration, start);
    }
    if (!on_step) continue;
    const MaterialReport now = report(SolveStatus::kImproved, iteration);
    if (!on_step(now)) return now;
  }
  return finish(SolveStatus::kIterationLimit, options_.max_iterations, start);
}

MaterialReport MaterialSolver::Impl::finish(SolveStatus status, int iterations,
                                            const Start& start) {
  const double total = total_energy();
  const bool is_higher = total > start.total + kNoEnergy * rows_.rest_energy();
  if (!(total < start.total)) restore(start);
  if (!is_higher || status == SolveStatus::kCancelled) return report(status, iterations);
  MaterialReport result = report(SolveStatus::kStalled, iterations);
  result.message = fmt::format(
      "no material of at most {:.3g} swings a frame has less energy than the start, which is kept",
      options_.max_frequency);
  return result;
}

MaterialReport MaterialSolver::Impl::report(SolveStatus status, int iterations) {
  MaterialReport result;
  result.status = status;
  result.iterations = iterations;
  result.evaluations = evaluations_;
  result.force_energy = systems_.energy(point_.z);
  result.constraint_energy = rows_.soft_energy(point_.rows.residual);
  result.column_energy = options_.column_weight * column_energy(point_.mixing);
  result.total_energy = result.force_energy + result.constraint_energy + result.column_energy;
  result.below_start = total_energy() < start_total_;
  static_cast<ConstraintErrors&>(result) = rows_.errors(point_.rows.residual);
  result.unit_force_energy = status == SolveStatus::kImproved
                                 ? 0
                                 : unit_force_energy(material_, motion(), beginning_of(timeline_));
  if (status == SolveStatus::kIterationLimit) {
    result.message = fmt::format(
        "the material is still improving after {} iterations; more would lower the energy further",
        iterations);
  } else if (status == SolveStatus::kStalled) {
    result.message = "no step of the material lowers the energy further";
  } else if (status == SolveStatus::kCancelled) {
    result.message = "the material's optimisation was cancelled";
  }
  return result;
}

MaterialSolver::MaterialSolver(std::shared_ptr<const reduced::Kinematics> kinematics,
                               Timeline timeline, const ConstraintSet& constraints,
                               Material material, const Eigen::MatrixXd& motion,
                               MaterialOptions options) {
  if (!kinematics) refuse_material("kinematics", "kinematics must not be null");
  validate(*kinematics, timeline, material, motion, options);
  impl_ = std::make_unique<Impl>(std::move(kinematics), timeline, constraints, std::move(material),
                                 motion, options);
}

MaterialSolver::~MaterialSolver() = default;
MaterialSolver::MaterialSolver(MaterialSolver&&) noexcept = default;
MaterialSolver& MaterialSolver::operator=(MaterialSolver&&) noexcept = default;

MaterialReport MaterialSolver::solve(const JobContext& job,
                                     const std::function<bool(const MaterialReport&)>& on_step) {
  return impl_->solve(job, on_step);
}
void MaterialSolver::resume(const Material& material, const Eigen::MatrixXd& motion) {
  validate(impl_->kinematics(), impl_->timeline(), material, motion, impl_->options());
  if (material.modes() != impl_->material().modes())
    refuse_material("material", fmt::format("material has {} modes, the solver's {}",
                                            material.modes(), impl_->material().modes()));
  impl_->resume(material, motion);
}
const Eigen::MatrixXd& MaterialSolver::motion() const { return impl_->motion(); }
const Material& MaterialSolver::material() const { return impl_->material(); }

}  // namespace limber::spacetime
