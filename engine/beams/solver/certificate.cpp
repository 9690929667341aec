#include "engine/beams/solver/certificate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "engine/beams/solver/balance.h"
#include "engine/beams/solver/following_tangent.h"
#include "engine/beams/solver/newton.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

namespace {

std::string saddle_text(int negative, const std::string& location) {
  return fmt::format(
      "the shape is balanced but unstable, a saddle: the stiffness has {} negative eigenvalue{}, "
      "and the energy decreases where {}; push it aside there with a small temporary load, or hold "
      "it",
      negative, negative == 1 ? "" : "s", location);
}

/// Is there no potential whose second derivatives tell whether a balanced state is stable?
bool lack_potential(const BeamStructure& structure, const NodeLoads& loads) {
  return loads.follows() || turns_free_nodes(structure, loads.moments);
}

/// Loads without a potential: the tangent with them says whether anything diverges.
void certify_following(const BeamStructure& structure, const JobContext& context,
                       const NodeLoads& loads, const BeamState& state, int softest,
                       BeamReport& report) {
  FollowingTangent tangent(structure);
  report.negative_eigenvalues = tangent.diverging(state, loads, context);
  ++report.factorizations;
  const char* const which =
      loads.follows() ? "loads that follow"
                      : "moments of fixed direction on nodes that turn about several axes";
  if (report.negative_eigenvalues == 0) {
    report.status = BeamStatus::kConverged;
    report.node = -1;
    report.message = fmt::format(
        "forces and moments balance, and no direction diverges; {} have no potential: whether they "
        "make it flutter is not judged",
        which);
    return;
  }
  report.status = BeamStatus::kUnstable;
  report.node = Balance(structure).node_of(softest);
  report.message = report.negative_eigenvalues
                       ? fmt::format("balanced, but not stable under {}: {} direction{}, where {}",
                                     which, *report.negative_eigenvalues,
                                     report.negative_eigenvalues == 1 ? " diverges" : "s diverge",
                                     location_text(structure, softest))
                       : fmt::format(
                             "balanced, but its stability under {} is not judged: that would take "
                             "fewer nodes",
                             which);
}

}  // namespace

std::string location_text(const BeamStructure& structure, int unknown) {
  if (unknown < 0) return "nowhere";
  if (unknown < 6 * structure.nodes())
    return fmt::format("{} {}", node_name(structure.model(), unknown / 6),
                       unknown % 6 < 3 ? "moves" : "turns");
  for (const ReleasedEnd& r : structure.released_ends()) {
    if (unknown >= r.unknown && unknown < r.unknown + r.axes)
      return fmt::format("the {} of {} turns", r.end == ElementEnd::kStart ? "start" : "finish",
                         element_name(structure.model(), r.element));
  }
  return "nowhere";
}

void report_status(const BeamStructure& structure, BeamStatus status, int unknown,
                   BeamReport& report) {
  report.status = status;
  report.node = Balance(structure).node_of(unknown);
  switch (status) {
    case BeamStatus::kConverged:
      report.message = "forces and moments balance at a minimum";
      break;
    case BeamStatus::kUnstable:
      report.message =
          saddle_text(report.negative_eigenvalues.value_or(1), location_text(structure, unknown));
      break;
    case BeamStatus::kMechanism:
      report.message = location_text(structure, unknown) + " without any resistance";
      break;
    default:
      if (!std::isfinite(report.residual)) {
        report.message = fmt::format(
            "forces grow beyond all bounds at load factor {:.6g}, where {}: is an element brought "
            "to no length?",
            report.load_factor, location_text(structure, unknown));
        return;
      }
      report.message =
          fmt::format("residual {:.2g} at load factor {:.6g}, worst where {}", report.residual,
                      report.load_factor, location_text(structure, unknown));
  }
}

void report_neutral(const BeamStructure& structure, const BeamState& state,
                    const Eigen::MatrixXd& neutral, BeamReport& report) {
  const Balance balance(structure);
  report.neutral_directions.clear();
  for (Eigen::Index i = 0; i < neutral.cols(); ++i) {
    const Eigen::VectorXd direction = neutral.col(i) / balance.size_of(neutral.col(i));
    int unknown = -1;
    direction.cwiseProduct(balance.weights().cwiseSqrt()).cwiseAbs().maxCoeff(&unknown);
    const int node = balance.node_of(unknown);
    const Eigen::Matrix3d spins =
        structure.spin_axes(node, state.rotations[static_cast<std::size_t>(node)]);
    report.neutral_directions.push_back({node,
                                         structure.node_axes(node) * direction.segment<3>(6 * node),
                                         spins * direction.segment<3>(6 * node + 3)});
    report.message +=
        fmt::format("{} neutral: it is one of a family of equal energy, along which {}",
                    i == 0 ? "; one direction is" : "; another direction is",
                    location_text(structure, unknown));
  }
}

bool turns_free_nodes(const BeamStructure& structure, const Eigen::Matrix3Xd& moments) {
  for (int i = 0; i < structure.nodes(); ++i) {
    if (moments.col(i).isZero(0)) continue;
    int axes = 0;
    for (int k = 3; k < 6; ++k)
      axes += structure.held()[static_cast<std::size_t>(6 * i + k)] == 0 ? 1 : 0;
    if (axes > 1) return true;
  }
  return false;
}

void certify(const BeamStructure& structure, const JobContext& context, const NodeLoads& loads,
             const BeamState& state, BeamReport& report) {
  using Stability = NewtonSolver::Stability;
  NewtonSolver newton(structure, context);
  const NewtonSolver::Verdict verdict = newton.judge(state, loads);
  report.factorizations += newton.factorizations();
  if (verdict.stability == Stability::kNotFinite) {
    report.status = BeamStatus::kUnstable;
    report.message = "balanced, but its stiffness is not finite: do nodes of an element coincide?";
    return;
  }
  const bool is_saddle = verdict.stability == Stability::kSaddle;
  // A direction along which the energy decreases was found.
  report.negative_eigenvalues =
      is_saddle ? std::max(1, newton.negative_eigenvalues(state, loads)) : 0;
  if (verdict.stability == Stability::kMechanism) {
    report.negative_eigenvalues.reset();
    report_status(structure, BeamStatus::kMechanism, verdict.unknown, report);
  } else if (lack_potential(structure, loads)) {
    certify_following(structure, context, loads, state, verdict.unknown, report);
  } else if (is_saddle) {
    report_status(structure, BeamStatus::kUnstable, verdict.unknown, report);
  } else {
    report_neutral(structure, state, verdict.neutral, report);
  }
}

void resolve(const BeamStructure& structure, const JobContext& context, const NodeLoads& loads,
             const BeamState& state, double tolerance, BeamReport& report) {
  if (!report.converged() || lack_potential(structure, loads)) return;
  const Balance balance(structure);
  const Eigen::VectorXd residual =
      elastic_gradient(structure, state) - load_vector(structure, loads, state);
  const Imbalance left =
      balance.imbalance(residual, balance.present(state, loads), Rounding::kCounted);
  if (left.scaled <= tolerance) return;
  NewtonSolver newton(structure, context);
  const std::optional<double> turn = newton.turn_left(state, loads);
  report.factorizations += newton.factorizations();
  if (!turn || *turn <= NewtonSolver::kResolvedTurn) return;
  report.status = BeamStatus::kStalled;
  report.node = balance.node_of(left.unknown);
  report.residual = left.scaled;
  report.negative_eigenvalues.reset();
  report.equilibrium_share.reset();
  report.message = fmt::format(
      "forces balance to {:.2g} of the largest, within tolerance and rounding, but the next step "
      "would turn by {:.2g} rad (limit {:g}): stiff parts hide what soft ones do; make stiffnesses "
      "or lengths less different",
      left.scaled, *turn, NewtonSolver::kResolvedTurn);
}

}  // namespace limber::beams::detail
