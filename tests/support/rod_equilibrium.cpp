#include "tests/support/rod_equilibrium.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/numerics/banded_cholesky.h"

namespace limber::rods {

namespace {

constexpr double kResolvedTurn = 1e-3;  // of a step from what balances but for rounding [rad]

Eigen::Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

/// One solve: what does not change from iterate to iterate.
class Newton {
 public:
  Newton(const RodState& start, const RodParameters& parameters, const RodLoads& loads,
         std::vector<char> fixed, const RodEquilibriumOptions& options)
      : layout_(start.layout()),
        parameters_(parameters),
        loads_(loads),
        fixed_(std::move(fixed)),
        options_(options) {
    for (int slot = 0; slot < layout_.nodes(); ++slot)
      if (!layout_.is_edge(slot)) fixed_[static_cast<std::size_t>(4 * slot + 3)] = 1;
    measure_scales(start);
  }

  RodEquilibrium run(RodAtSource at);

 private:
  struct Evaluation {
    double potential = 0;
    double rounding = 0;  // of the potential
    RodEnergies energies;
    Eigen::VectorXd gradient;
  };

  void measure_scales(const RodState& start);
  [[nodiscard]] Evaluation evaluate(const RodAtSource& from, const RodState& state) const;
  void add_moment(int slot, const RodAtSource& from, const RodState& state, Evaluation& e) const;
  [[nodiscard]] double residual(const RodState& state, const Eigen::VectorXd& gradient) const;
  [[nodiscard]] Eigen::MatrixXd band(const RodAtSource& at) const;
  [[nodiscard]] Eigen::VectorXd direction(const RodAtSource& at, const Eigen::VectorXd& gradient,
                                          RodReport& report);
  [[nodiscard]] Eigen::VectorXd moved(const RodState& from, const Eigen::VectorXd& step,
                                      double fraction) const;
  /// The largest angle that a step turns an edge by [rad].
  [[nodiscard]] double turn_of(const RodState& from, const Eigen::VectorXd& step) const;
  [[nodiscard]] double longest_fraction(const RodState& from, const Eigen::VectorXd& step) const;
  [[nodiscard]] std::optional<RodAtSource> lower(const RodAtSource& from, const Evaluation& here,
                                                 const Eigen::VectorXd& step, double slope) const;
  [[nodiscard]] std::optional<RodAtSource> off_saddle(const RodAtSource& at,
                                                      const Evaluation& here) const;
  [[nodiscard]] bool is_fixed(int unknown) const {
    return fixed_[static_cast<std::size_t>(unknown)] != 0;
  }

  const RodLayout& layout_;
  const RodParameters& parameters_;
  const RodLoads& loads_;
  std::vector<char> fixed_;
  RodEquilibriumOptions options_;
  BandedCholesky cholesky_;  // of the last shifted Hessian
  double shift_ = 0;
  Eigen::VectorXd shift_scale_;  // bending and torsion stiffness of an edge, per unknown
  double force_rounding_ = 0;
};

void Newton::measure_scales(const RodState& start) {
  using P = RodParameters;
  double bending = 0, torsion = 0, length = 0, stretching = 0, size = 0;
  double shortest = std::numeric_limits<double>::infinity();
  int edges = 0;
  for (int slot = 0; slot < layout_.nodes(); ++slot) {
    size = std::max(size, start.unknowns().segment<3>(4 * slot).cwiseAbs().maxCoeff());
    if (layout_.is_interior(slot)) {
      bending =
          std::max({bending, parameters_(slot, P::kBending1), parameters_(slot, P::kBending2)});
      torsion = std::max(torsion, parameters_(slot, P::kTorsion));
    }
    if (!layout_.is_edge(slot)) continue;
    ++edges;
    length += parameters_(slot, P::kRestLength);
    shortest = std::min(shortest, parameters_(slot, P::kRestLength));
    stretching = std::max(stretching, parameters_(slot, P::kStretching));
  }
  length /= edges;
  if (bending == 0) bending = torsion = stretching * length * length;  // a bar of one edge
  shift_scale_.resize(layout_.unknowns());
  for (int i = 0; i < layout_.unknowns(); ++i)
    shift_scale_[i] = i % 4 == 3 ? torsion / length : bending / (length * length * length);
  force_rounding_ =
      16 * std::numeric_limits<double>::epsilon() * stretching * (1 + size / shortest);
}

/// A dead moment does the work M . omega, omega the rotation of its edge since the source.
void Newton::add_moment(int slot, const RodAtSource& from, const RodState& state,
                        Evaluation& e) const {
  const Eigen::Vector3d moment = loads_.moments.col(slot);
  if (moment.isZero(0)) return;
  const MaterialFrame<double> frame = state.frame(slot), source = from.state().frame(slot);
  const Eigen::Vector3d t = eigen(frame.tangent), s = eigen(source.tangent);
  const Eigen::Vector3d axis = s.cross(t);
  const double sine = axis.norm();
  Eigen::Vector3d rotation =
      sine > 0 ? Eigen::Vector3d(axis * (std::atan2(sine, s.dot(t)) / sine)) : axis;
  rotation +=
      (state.unknowns()[4 * slot + 3] - from.state().unknowns()[4 * slot + 3]) * 0.5 * (s + t);
  e.potential -= moment.dot(rotation);
  const double torque = moment.dot(t);
  const Eigen::Vector3d force = moment.cross(t) / frame.length + torque * eigen(frame.transport);
  e.gradient.segment<3>(4 * (slot + 1)) -= force;
  e.gradient.segment<3>(4 * slot) += force;
  e.gradient[4 * slot + 3] -= torque;
}

Newton::Evaluation Newton::evaluate(const RodAtSource& from, const RodState& state) const {
  RodState::Forces forces = state.forces(parameters_);
  Evaluation result{forces.energies.total(), 0, forces.energies, std::move(forces.gradient)};
  const Eigen::VectorXd& x = state.unknowns();
  double size = std::abs(result.potential);
  for (int slot = 0; slot < layout_.nodes(); ++slot) {
    if (loads_.forces.size() > 0) {
      const double work = loads_.forces.col(slot).dot(x.segment<3>(4 * slot));
      result.potential -= work;
      size += std::abs(work);
      result.gradient.segment<3>(4 * slot) -= loads_.forces.col(slot);
    }
    if (!layout_.is_edge(slot)) continue;
    if (loads_.torques.size() > 0) {
      const double work = loads_.torques[slot] * x[4 * slot + 3];
      result.potential -= work;
      size += std::abs(work);
      result.gradient[4 * slot + 3] -= loads_.torques[slot];
    }
    if (loads_.moments.size() > 0) add_moment(slot, from, state, result);
  }
  for (int i = 0; i < layout_.unknowns(); ++i)
    if (is_fixed(i)) result.gradient[i] = 0;
  result.rounding = 1e-14 * size;
  return result;
}

double Newton::residual(const RodState& state, const Eigen::VectorXd& gradient) const {
  // Forces present: what each edge passes on, from the gradients of the rods alone.
  const Eigen::VectorXd internal = state.gradient(parameters_);
  double force = 0, moment = 0, free_force = 0, free_torque = 0, length = 0;
  Eigen::Vector3d passed = Eigen::Vector3d::Zero();
  for (int slot = 0; slot < layout_.nodes(); ++slot) {
    passed -= internal.segment<3>(4 * slot);
    if (!layout_.is_edge(slot)) passed.setZero();
    force = std::max(force, passed.norm());
    free_force = std::max(free_force, gradient.segment<3>(4 * slot).norm());
    if (layout_.is_edge(slot)) length = std::max(length, state.frame(slot).length);
    if (!layout_.is_interior(slot)) continue;
    const auto s = state.strains(slot);
    const double l = 0.5 * (parameters_(slot - 1, RodParameters::kRestLength) +
                            parameters_(slot, RodParameters::kRestLength));
    moment =
        std::max({moment, parameters_(slot, RodParameters::kBending1) * std::abs(s.after_1) / l,
                  parameters_(slot, RodParameters::kBending2) * std::abs(s.after_2) / l,
                  parameters_(slot, RodParameters::kTorsion) * std::abs(s.twist) / l});
    free_torque = std::max(free_torque, std::abs(gradient[4 * slot + 3]));
  }
  force = std::max(force, moment / length) + force_rounding_ / options_.tolerance;
  moment += force_rounding_ * length / options_.tolerance;
  return std::max(free_force / force, free_torque / moment);
}

Eigen::MatrixXd Newton::band(const RodAtSource& at) const {
  Eigen::MatrixXd result = banded(layout_, at.hessian(parameters_));
  const auto add = [&](int row, int column, double value) {
    if (row >= column) result(row - column, column) += value;
  };
  if (loads_.moments.size() > 0) {
    for (int slot = 0; slot < layout_.nodes(); ++slot) {
      if (!layout_.is_edge(slot) || loads_.moments.col(slot).isZero(0)) continue;
      // Symmetric part of the change of the forces above at the source.
      const MaterialFrame<double> frame = at.state().frame(slot);
      const Eigen::Vector3d t = eigen(frame.tangent), m = loads_.moments.col(slot);
      const Eigen::Vector3d mt = m.cross(t) / (frame.length * frame.length);
      const Eigen::Matrix3d ee = mt * t.transpose() + t * mt.transpose();
      const Eigen::Vector3d et = -0.5 / frame.length * (m - m.dot(t) * t);
      const int x0 = 4 * slot, x1 = x0 + 4, th = x0 + 3;
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
          add(x0 + r, x0 + c, ee(r, c));
          add(x1 + r, x1 + c, ee(r, c));
          add(x1 + r, x0 + c, -ee(r, c));
        }
        add(th, x0 + r, -et[r]);
        add(x1 + r, th, et[r]);
      }
    }
  }
  for (int i = 0; i < layout_.unknowns(); ++i) {
    for (int d = 0; d <= kRodBandwidth && i + d < layout_.unknowns(); ++d)
      if (is_fixed(i) || is_fixed(i + d)) result(d, i) = 0;
    if (is_fixed(i)) result(0, i) = shift_scale_[i];
  }
  return result;
}

Eigen::VectorXd Newton::direction(const RodAtSource& at, const Eigen::VectorXd& gradient,
                                  RodReport& report) {
  const Eigen::MatrixXd hessian = band(at);
  // Of the stiffness of one edge: the softest modes of a rod of 60 edges are about this stiff.
  constexpr double kSmallestShift = 1e-7;
  // Beyond this every row is dominated by its diagonal (edges all but folded back: 1 / chi^2).
  const double largest = 100 * hessian.cwiseAbs().maxCoeff() / shift_scale_.minCoeff();
  report.stable = true;
  for (double shift = 0;; shift = std::max({10 * shift, 0.1 * shift_, kSmallestShift})) {
    Eigen::MatrixXd shifted = hessian;
    if (shift > 0) shifted.row(0) += shift * shift_scale_.transpose();
    ++report.factorizations;
    if (cholesky_.factor(std::move(shifted))) {
      shift_ = shift;
      break;
    }
    report.stable = false;
    LIMBER_DEMAND(shift <= largest);
  }
  BandedCholesky::Columns step = -gradient;
  cholesky_.solve(step);
  return step;
}

/// Unknowns a fraction of a step on: edges turn by their rotation and stretch by their stretch, so
/// that turning costs no stretch; the gaps which that opens at fixed coordinates are closed evenly.
Eigen::VectorXd Newton::moved(const RodState& from, const Eigen::VectorXd& step,
                              double fraction) const {
  Eigen::VectorXd x = from.unknowns();
  for (int r = 0; r < layout_.rods(); ++r) {
    const int first = layout_.first_node(r), last = first + layout_.edges(r);
    x.segment<3>(4 * first) += fraction * step.segment<3>(4 * first);
    for (int slot = first; slot < last; ++slot) {
      const MaterialFrame<double> frame = from.frame(slot);
      const Eigen::Vector3d t = eigen(frame.tangent);
      const Eigen::Vector3d de =
          fraction * (step.segment<3>(4 * (slot + 1)) - step.segment<3>(4 * slot));
      const double along = t.dot(de);
      const Eigen::Vector3d across = (de - along * t) / frame.length;
      const double angle = across.norm();
      const Eigen::Vector3d direction =
          std::cos(angle) * t + (angle > 0 ? std::sin(angle) / angle : 1.0) * across;
      // A stretch never turns an edge round.
      const double length = frame.length * std::max(1 + along / frame.length, 0.1);
      x.segment<3>(4 * (slot + 1)) = x.segment<3>(4 * slot) + length * direction;
      x[4 * slot + 3] += fraction * step[4 * slot + 3];
    }
    for (int c = 0; c < 3; ++c) {
      int from_slot = -1;
      double gap_before = 0;
      for (int slot = first; slot <= last; ++slot) {
        const bool held = is_fixed(4 * slot + c);
        if (!held) continue;
        const double gap = from.unknowns()[4 * slot + c] - x[4 * slot + c];
        const int begin = from_slot < 0 ? first : from_slot + 1;
        for (int k = begin; k < slot; ++k) {
          const double share = from_slot < 0 ? 1.0 : double(k - from_slot) / (slot - from_slot);
          x[4 * k + c] += from_slot < 0 ? gap : gap_before + share * (gap - gap_before);
        }
        from_slot = slot;
        gap_before = gap;
      }
      for (int k = from_slot < 0 ? last + 1 : from_slot + 1; k <= last; ++k)
        x[4 * k + c] += gap_before;
    }
    for (int slot = first; slot <= last; ++slot)
      for (int c = 0; c < 3; ++c)
        if (is_fixed(4 * slot + c)) x[4 * slot + c] = from.unknowns()[4 * slot + c];
  }
  return x;
}

double Newton::turn_of(const RodState& from, const Eigen::VectorXd& step) const {
  double turn = 0;
  for (int slot = 0; slot < layout_.nodes(); ++slot) {
    if (!layout_.is_edge(slot)) continue;
    const MaterialFrame<double> frame = from.frame(slot);
    const Eigen::Vector3d de = step.segment<3>(4 * (slot + 1)) - step.segment<3>(4 * slot);
    const Eigen::Vector3d t = eigen(frame.tangent);
    turn = std::max(
        {turn, (de - t.dot(de) * t).norm() / frame.length, 0.5 * std::abs(step[4 * slot + 3])});
  }
  return turn;
}

double Newton::longest_fraction(const RodState& from, const Eigen::VectorXd& step) const {
  const double turn = turn_of(from, step);
  return turn > options_.largest_turn ? options_.largest_turn / turn : 1.0;
}

/// Backtracks along a step of the given slope (not positive).
std::optional<RodAtSource> Newton::lower(const RodAtSource& from, const Evaluation& here,
                                         const Eigen::VectorXd& step, double slope) const {
  double fraction = longest_fraction(from.state(), step);
  for (int trial = 0; trial < 40; ++trial, fraction *= 0.5) {
    RodState next = from.moved(moved(from.state(), step, fraction));
    if (!next.is_finite()) continue;
    const Evaluation there = evaluate(from, next);
    if (there.potential <=
        here.potential + 1e-4 * fraction * slope + here.rounding + there.rounding)
      return RodAtSource(std::move(next));
  }
  return std::nullopt;
}

/// Along the direction in which the energy decreases most, by inverse iteration with the factor at
/// hand, to the side that is lower.
std::optional<RodAtSource> Newton::off_saddle(const RodAtSource& at, const Evaluation& here) const {
  BandedCholesky::Columns v(layout_.unknowns(), 1);
  for (int i = 0; i < layout_.unknowns(); ++i)
    v(i, 0) = is_fixed(i) ? 0 : 1 + std::sin(1.7 * i + 0.3);  // in no symmetry's plane
  for (int step = 0; step < 30; ++step) {
    v.col(0).array() *= shift_scale_.array();
    cholesky_.solve(v);
    v /= v.norm();
  }
  std::optional<RodAtSource> best;
  double lowest = here.potential - 10 * here.rounding;
  for (const double side : {1.0, -1.0}) {
    Eigen::VectorXd step = side * 1e6 * v.col(0);  // as far as largest_turn lets it, then less
    step *= longest_fraction(at.state(), step);
    for (double fraction = 1; fraction > 1e-4; fraction *= 0.25) {
      RodState next = at.moved(moved(at.state(), step, fraction));
      if (!next.is_finite()) continue;
      const Evaluation there = evaluate(at, next);
      if (there.potential >= lowest) continue;
      lowest = there.potential;
      best = RodAtSource(std::move(next));
      break;
    }
  }
  return best;
}

RodEquilibrium Newton::run(RodAtSource at) {
  RodReport report;
  const bool may_leave = options_.at_saddle == AtSaddle::kLeave && loads_.moments.size() == 0;
  for (;; ++report.iterations) {
    const Evaluation here = evaluate(at, at.state());
    report.residual = residual(at.state(), here.gradient);
    report.energies = here.energies;
    // At a balanced state one more factorisation says whether it is a minimum.
    const Eigen::VectorXd step = direction(at, here.gradient, report);
    std::optional<RodAtSource> next;
    // Of rods so stiff that rounding hides their loads, the next step says that it is not over.
    const bool is_hidden = report.stable && turn_of(at.state(), step) > kResolvedTurn;
    if (report.residual <= options_.tolerance && !is_hidden) {
      report.status = RodStatus::kConverged;
      if (report.stable || !may_leave || report.iterations == options_.max_iterations) break;
      next = off_saddle(at, here);
      if (!next) break;
      ++report.saddles_left;
      report.status = RodStatus::kIterationLimit;
    } else {
      if (report.iterations == options_.max_iterations) break;
      next = lower(at, here, step, here.gradient.dot(step));
      if (!next) {
        report.status = RodStatus::kStalled;
        break;
      }
    }
    at = std::move(*next);
  }
  return {std::move(at), report};
}

}  // namespace

void RodEquilibriumOptions::validate() const {
  const auto refuse = [](const char* name, const char* rule, double value) {
    throw Error(ErrorCode::kInvalidArgument, name, fmt::format("must be {}, got {}", rule, value));
  };
  if (max_iterations <= 0) refuse("max_iterations", "positive", max_iterations);
  if (!(tolerance > 0) || !(tolerance < 1)) refuse("tolerance", "in (0, 1)", tolerance);
  if (!(largest_turn > 0) || !(largest_turn <= 1.5))
    refuse("largest_turn", "in (0, 1.5]", largest_turn);
}

RodEquilibrium find_equilibrium(const RodState& start, const RodParameters& parameters,
                                const RodLoads& loads, const std::vector<char>& fixed,
                                const RodEquilibriumOptions& options) {
  options.validate();
  const RodLayout& layout = start.layout();
  const auto demand = [](bool condition, const char* field, const char* rule) {
    if (!condition) throw Error(ErrorCode::kInvalidArgument, field, rule);
  };
  const Eigen::Index nodes = layout.nodes();
  demand(fixed.size() == static_cast<std::size_t>(layout.unknowns()), "fixed",
         "one value per unknown is needed");
  demand(loads.forces.size() == 0 || loads.forces.cols() == nodes, "loads.forces",
         "one column per node is needed");
  demand(loads.torques.size() == 0 || loads.torques.size() == nodes, "loads.torques",
         "one value per slot is needed");
  demand(loads.moments.size() == 0 || loads.moments.cols() == nodes, "loads.moments",
         "one column per slot is needed");
  demand(loads.forces.allFinite() && loads.torques.allFinite() && loads.moments.allFinite(),
         "loads", "loads must be finite");
  parameters.validate(layout);
  return Newton(start, parameters, loads, fixed, options).run(RodAtSource(start));
}

}  // namespace limber::rods
