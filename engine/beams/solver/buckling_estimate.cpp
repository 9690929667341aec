#include "engine/beams/solver/buckling_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/balance.h"
#include "engine/beams/solver/newton.h"
#include "engine/beams/solver/stability.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

namespace {

constexpr double kFirstShare = 1e-3;  // of the loads: the state that is extrapolated
// Forces that rounding of the start, or a solve before, leaves: far below the first share.
constexpr double kUnloaded = 1e-6;
constexpr double kTolerance = 1e-8;        // of the balance at that share
constexpr int kMaxBalanceIterations = 20;  // Newton iterations of that solve at most
constexpr double kMinCompressed =
    1e-6;  // share of the buckling load that is distinguished from rounding

/// Reduction of the stiffness by compression, over the stiffness without it: the lowest quotient,
/// and the largest unknown of its direction. Nothing where factorization fails.
struct BucklingMode {
  double quotient = 0;
  int unknown = -1;
};
std::optional<BucklingMode> buckling_mode(const BeamStructure& structure, const Balance& balance,
                                          const BeamState& state, const NodeLoads& loads,
                                          const JobContext& context) {
  Stiffness stiffness(structure);
  stiffness.assemble(state, Compression::kLeftOut);
  if (stiffness.size() == 0 || !stiffness.matrix().coeffs().allFinite()) return {};
  SparseCholesky factor;
  try {
    factor.analyse(stiffness.matrix());
    factor.refactor(stiffness.matrix());
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kNumerical) throw;
    return {};
  }
  Eigen::SparseMatrix<double> change = stiffness.matrix();
  stiffness.assemble(state, loads);
  change.coeffs() = stiffness.matrix().coeffs() - change.coeffs();
  if (change.coeffs().isZero(0)) return {};
  const CurvedDirection lowest =
      lowest_quotient(change, factor, stiffness.restricted(balance.weights()), context);
  BucklingMode mode;
  mode.quotient = lowest.quotient;
  stiffness.extended(lowest.direction)
      .cwiseProduct(balance.weights().cwiseSqrt())
      .cwiseAbs()
      .maxCoeff(&mode.unknown);
  return mode;
}

void find_most_compressed(const BeamStructure& structure, const BeamState& state, double share,
                          BucklingEstimate& estimate) {
  const BeamModel& model = structure.model();
  for (int i = 0; i < structure.elements(); ++i) {
    const BeamElement& element = model.elements[static_cast<std::size_t>(i)];
    if (element.kind != BeamKind::kBeam) continue;
    const BeamSection& section = model.sections[static_cast<std::size_t>(element.section)];
    const double length = structure.constants(i).length;
    const double compression = -strain_force(structure, state, i) / share * length * length /
                               std::min(section.bending_2, section.bending_3);
    if (!(compression > estimate.compression)) continue;
    estimate.compression = compression;
    estimate.element = i;
  }
}

/// A certified saddle or mechanism, or a limit of work, has a message of its own.
bool has_own_explanation(const BeamReport& report) {
  return report.converged() || report.negative_eigenvalues.has_value() ||
         report.status == BeamStatus::kMechanism || report.status == BeamStatus::kCancelled;
}

std::string advice_for(const BeamModel& model, const BucklingEstimate& estimate) {
  if (estimate.element >= 0 && estimate.compression > kMaxResolvedCompression) {
    const double pieces = std::ceil(std::sqrt(estimate.compression / kMaxResolvedCompression));
    return fmt::format(
        "{} has a compression of {:.3g} EI/L^2 there, and up to {} is resolved: divide it "
        "into {:.0f} elements, and others like it",
        element_name(model, estimate.element), estimate.compression, kMaxResolvedCompression,
        pieces);
  }
  return "use more elements, apply the loads in smaller steps, or use dynamic relaxation with a "
         "small temporary load across the members";
}

}  // namespace

std::optional<BucklingEstimate> estimate_buckling(const BeamStructure& structure,
                                                  const BeamState& start, const LoadPath& path,
                                                  const JobContext& context) {
  const LoadPath loading = path.without_temporary_loads();
  if (!loading.begins_unloaded(kUnloaded, Balance(structure).extent()) || !loading.varies())
    return {};
  NewtonSolver newton(structure, context);
  BeamState state = start;
  if (newton.balance(state, loading, kFirstShare, kTolerance, kMaxBalanceIterations) !=
      NewtonOutcome::kBalanced)
    return {};
  const auto mode =
      buckling_mode(structure, Balance(structure), state, loading.loads(kFirstShare), context);
  if (!mode || !(-mode->quotient > kMinCompressed)) return {};
  BucklingEstimate estimate;
  estimate.load_share = kFirstShare / -mode->quotient;
  estimate.unknown = mode->unknown;
  if (structure.model().motions.empty())
    find_most_compressed(structure, state, kFirstShare, estimate);
  return estimate;
}

void explain_failure(const BeamStructure& structure, const BeamState& start, const LoadPath& path,
                     const JobContext& context, BeamReport& report) {
  if (has_own_explanation(report)) return;
  const auto estimate = estimate_buckling(structure, start, path, context);
  if (!estimate || estimate->load_share >= 1) return;
  const int node = Balance(structure).node_of(estimate->unknown);
  report.message += fmt::format(
      "; the structure as drawn buckles at {:.3g} % of the loads (linear estimate{}); {}",
      100 * estimate->load_share,
      node < 0 ? "" : fmt::format(", {} moves most", node_name(structure.model(), node)),
      advice_for(structure.model(), *estimate));
}

}  // namespace limber::beams::detail
