#include "bench/ipopt_program.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace limber::bench {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using Vector = Eigen::VectorXd;
using Given = Eigen::Map<const Vector>;
using Answer = Eigen::Map<Vector>;
using Which = rods::LinkageDesign::Which;

constexpr int kConstraints = 2;
/// Ipopt comes back to iterates of a few trials ago.
constexpr std::size_t kRemembered = 12;
constexpr double kNoStep = 1e-8;  // share of the mean length that is next to none
/// Multipliers of inactive constraints: the addition of their curvature to that of J, which begins
/// at one, is left out. With it a product takes nearly twice as long.
constexpr double kNoForce = 1e-4;
constexpr double kNoEnergy = 1e-12;  // share of the scale of energies that is rounding

}  // namespace

IpoptProgram::IpoptProgram(rods::LinkageDesign& design, const rods::DesignOptimizerOptions& options,
                           double seconds, DesignTrace& trace)
    : design_(design),
      options_(options),
      seconds_(seconds),
      trace_(trace),
      start_(design.parameters()),
      unit_(start_.mean()),
      flatness_allowed_(std::pow(options.flat_height * design.criteria().length_scale, 2) *
                        design.model().variables().joints()) {
  return_to(design.point());
  objective_unit_ = values().objective;
}

void IpoptProgram::begin_round(const rods::detail::GuardWeight& guard, int held) {
  guard_ = guard;
  held_ = held;
  rounds_iterations_ = report_.iterations;
  interruption_ = Interruption::kNone;
  lost_ = rods::LostShape::kNone;
}

double IpoptProgram::flat_energy() const {
  const double scale = design_.criteria().energy_scale;
  return values().flat_energy > kNoEnergy * scale ? values().flat_energy : scale;
}

void IpoptProgram::return_to(const rods::DesignPoint& point) {
  design_.move_to(point);
  here_ = {design_.parameters() / unit_, point, design_.values(point)};
}

bool IpoptProgram::get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian,
                                IndexStyleEnum& style) {
  n = static_cast<Index>(start_.size());
  m = kConstraints;
  jacobian = m * n;
  hessian = n * (n + 1) / 2;
  style = C_STYLE;
  return true;
}

bool IpoptProgram::get_bounds_info(Index n, Number* low, Number* high, Index m, Number* least,
                                   Number* most) {
  Answer(low, n) = options_.shortest * start_ / unit_;
  Answer(high, n) = options_.longest * start_ / unit_;
  Answer(least, m).setZero();
  Answer(most, m).setConstant(2e19);  // none
  return true;
}

bool IpoptProgram::get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool,
                                      Number*) {
  Answer(x, n) = here_.x;
  return true;
}

bool IpoptProgram::eval_f(Index n, const Number* x, bool, Number& objective) {
  const Evaluation& here = see(Given(x, n));
  objective = (here.values.objective + guard_.weight() * here.values.flat_energy) / objective_unit_;
  return here.point.has_value();
}

bool IpoptProgram::eval_g(Index n, const Number* x, bool, Index, Number* rooms) {
  const Evaluation& here = see(Given(x, n));
  rooms[0] = 1 - here.values.flatness / flatness_allowed_;
  rooms[1] = here.values.smallest_angle - options_.smallest_angle;
  return here.point.has_value();
}

bool IpoptProgram::eval_grad_f(Index n, const Number* x, bool, Number* gradient) {
  if (!stand_at(Given(x, n))) return false;
  const auto& by = design_.gradients(Which::kObjective);
  Answer(gradient, n) = unit_ / objective_unit_ * (by.objective + guard_.weight() * by.flat_energy);
  return true;
}

bool IpoptProgram::eval_jac_g(Index n, const Number* x, bool, Index m, Index, Index* rows,
                              Index* columns, Number* values) {
  if (values == nullptr) {
    for (Index row = 0, k = 0; row < m; ++row) {
      for (Index column = 0; column < n; ++column, ++k) {
        rows[k] = row;
        columns[k] = column;
      }
    }
    return true;
  }
  if (!stand_at(Given(x, n))) return false;
  const auto& by = design_.gradients(Which::kAll);
  Answer(values, n) = -unit_ / flatness_allowed_ * by.flatness;
  Answer(values + n, n) = unit_ * by.smallest_angle;
  return true;
}

bool IpoptProgram::eval_h(Index n, const Number* x, bool, Number objective_factor, Index,
                          const Number* multipliers, bool, Index, Index* rows, Index* columns,
                          Number* values) {
  if (values == nullptr) {
    for (Index row = 0, k = 0; row < n; ++row) {
      for (Index column = 0; column <= row; ++column, ++k) {
        rows[k] = row;
        columns[k] = column;
      }
    }
    return true;
  }
  if (!stand_at(Given(x, n))) return false;
  const Eigen::MatrixXd whole = hessian(objective_factor / objective_unit_,
                                        -multipliers[0] / flatness_allowed_, multipliers[1]);
  for (Index row = 0, k = 0; row < n; ++row) {
    for (Index column = 0; column <= row; ++column, ++k)
      values[k] = 0.5 * (whole(row, column) + whole(column, row));
  }
  return true;
}

bool IpoptProgram::intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number,
                                         Number, Number, Number length, Number, Number,
                                         Number share, Index, const Ipopt::IpoptData*,
                                         Ipopt::IpoptCalculatedQuantities*) {
  report_.iterations = rounds_iterations_ + iteration;
  trace_.note(report_.iterations, values());
  if (trace_.seconds() >= seconds_) {
    interruption_ = Interruption::kTime;
  } else if (guard_.weight() > 0 && iteration > 0) {
    if (share * length < kNoStep && lost_ == rods::LostShape::kFlat)
      interruption_ = Interruption::kFlatLost;
    else if (iteration >= held_ && guard_.hinders(values().objective, flat_energy()))
      interruption_ = Interruption::kGuardHinders;
  }
  lost_ = rods::LostShape::kNone;
  return interruption_ == Interruption::kNone;
}

const IpoptProgram::Evaluation& IpoptProgram::see(const Vector& x) {
  if (here_.x == x) return here_;
  for (const Evaluation& evaluation : evaluations_)
    if (evaluation.x == x) return evaluation;
  ++report_.trials;
  rods::DesignTrial trial = design_.trial(unit_ * x);
  report_.newton_steps += trial.iterations;
  Evaluation evaluation{x, {}, {}};
  if (trial.status == rods::TrialStatus::kFound) {
    evaluation.values = design_.values(trial.point);
    evaluation.point = std::move(trial.point);
  } else {
    ++report_.not_believed;
    lost_ = trial.lost;
  }
  remember(std::move(evaluation));
  return evaluations_.front();
}

void IpoptProgram::remember(Evaluation evaluation) {
  if (evaluations_.size() == kRemembered) evaluations_.pop_back();
  evaluations_.push_front(std::move(evaluation));
}

/// @returns false where it cannot
bool IpoptProgram::stand_at(const Vector& x) {
  if (x == here_.x) return true;
  Evaluation there = see(x);
  if (!there.point) return false;
  design_.move_to(*there.point);
  std::swap(here_, there);
  remember(std::move(there));
  return true;
}

/// Hessian of the weighted sum of the measures, by x.
Eigen::MatrixXd IpoptProgram::hessian(double objective, double flatness, double angle) {
  const Index n = static_cast<Index>(start_.size());
  const double most = std::max(std::abs(flatness) * flatness_allowed_, std::abs(angle));
  const Which which = most <= kNoForce ? Which::kObjective : Which::kAll;
  Eigen::MatrixXd whole(n, n);
  for (Index k = 0; k < n; ++k) {
    const auto bent = design_.products(Vector::Unit(n, k), which);
    whole.col(k) = objective * (bent.objective + guard_.weight() * bent.flat_energy);
    if (which == Which::kAll)
      whole.col(k) += flatness * bent.flatness + angle * bent.smallest_angle;
  }
  report_.products += n;
  return unit_ * unit_ * whole;
}

}  // namespace limber::bench
