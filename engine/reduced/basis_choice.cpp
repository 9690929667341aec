#include "engine/reduced/basis_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/base/error.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/modal_derivatives.h"
#include "engine/reduced/cubature.h"
#include "engine/reduced/snapshot_basis.h"

namespace limber::reduced {
namespace {

constexpr int kLargestBasis = 200;  // columns at most where no number is requested
constexpr int kLeadingModes = 30;   // space-time editing, section 3.1
constexpr Eigen::Index kMaxPairs =
    kLeadingModes * (kLeadingModes + 1) / 2;  // all pairs of the leading modes
constexpr Eigen::Index kTurnedPairs = 135;    // room for the turned modes of a free body
// Numbers in all derivatives of a mesh: bounds memory, and the time of their solves.
constexpr Eigen::Index kMaxDerivativeValues = 12'000'000;
// More columns than those of this share of the tolerance would hardly let the cubature be smaller.
constexpr double kEnough = 0.4;
// The modes themselves come first where the basis is at least this many times their number.
constexpr int kRoomForModes = 2;
constexpr int kTurns = 3;  // rotations, the last of the six rigid columns

/// Pairs (i <= j), of which j is elastic and i elastic or a rotation, of the first `columns`.
std::vector<bodies::ModePair> all_pairs(int rigid_count, int columns) {
  std::vector<bodies::ModePair> pairs;
  for (int i = rigid_count > 0 ? rigid_count - kTurns : 0; i < columns; ++i) {
    for (int j = std::max(i, rigid_count); j < columns; ++j) pairs.push_back({i, j});
  }
  return pairs;
}

Eigen::Index affordable_pairs(Eigen::Index rows, int rigid_count) {
  return std::min(kMaxPairs + (rigid_count > 0 ? kTurnedPairs : 0), kMaxDerivativeValues / rows);
}

/// Up to 200 frames, spread over the animation.
Eigen::MatrixXd chosen_frames(const Eigen::MatrixXd& animation) {
  constexpr Eigen::Index kMaxFrames = 200;  // of an animation that join the snapshots
  const Eigen::Index taken = std::min(animation.cols(), kMaxFrames);
  Eigen::MatrixXd frames(animation.rows(), taken);
  for (Eigen::Index i = 0; i < taken; ++i)
    frames.col(i) = animation.col(i * animation.cols() / taken);
  return frames;
}

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

/// Weighted fields with frames that count a quarter of what these do, all frames the same.
Eigen::MatrixXd enriched(const Eigen::MatrixXd& fields, const Eigen::MatrixXd& animation) {
  constexpr double kAnimationShare = 0.25;  // of the fields' squared norm that frames get together
  if (animation.cols() == 0) return fields;
  Eigen::MatrixXd frames = chosen_frames(animation);
  const double length =
      std::sqrt(kAnimationShare / static_cast<double>(frames.cols())) * fields.norm();
  for (Eigen::Index i = 0; i < frames.cols(); ++i) {
    const double norm = frames.col(i).norm();
    if (norm > 0) frames.col(i) *= length / norm;
  }
  return beside(fields, frames);
}

/// The fields that the basis of a free body spans exactly: its rigid motions, or its translations
/// if the requested basis is too small for these. If there is ample room, the modes too: then the
/// linear regime is right.
Eigen::MatrixXd exact_fields(const BasisInput& input) {
  const bodies::ElasticBody& body = input.body;
  const int size = input.options.basis_size, nodes = body.mesh.node_count();
  Eigen::MatrixXd fields(3 * nodes, 0);
  if (body.is_free()) {
    constexpr int kTranslations = 3;  // rigid translations come first
    fields = affine_fields(body);
    if (size > 0 && size <= fields.cols()) fields = fields.leftCols(kTranslations).eval();
  }
  const int modes = input.modes.elastic_count();
  const auto free_dofs = 3 * (nodes - static_cast<int>(body.fixed_nodes.size()));
  if (size < fields.cols() + kRoomForModes * modes || 2 * size > free_dofs) return fields;
  return beside(fields, input.modes.modes.rightCols(modes));
}

struct Candidate {
  BasisKind kind;
  Eigen::MatrixXd basis;
  PoseData validation;
  Eigen::VectorXd error;  // mean on the validation poses per size
};

Candidate make_candidate(const BasisInput& input, const Eigen::MatrixXd& exact, BasisKind kind,
                         const JobContext& job) {
  const Eigen::VectorXd mass = bodies::lumped_node_mass(input.body.mesh);
  const int largest = input.options.basis_size > 0 ? input.options.basis_size : kLargestBasis;
  const TrainingSet& set = input.set;
  Candidate made{kind, {}, {}, {}};
  if (kind == BasisKind::kSnapshots) {
    made.basis = snapshot_basis(beside(set.train.u, chosen_frames(input.animation)), mass, exact,
                                largest, FieldScaling::kUnit);
  } else {
    const Eigen::VectorXd norm = set.train.u.colwise().norm();
    const Eigen::MatrixXd fields =
        kind == BasisKind::kModalDerivatives
            ? stvk_fields(input.body, input.modal, job)
            : map_fields(input.modes, input.full, set.train.z, norm, job);
    made.basis = snapshot_basis(enriched(fields, input.animation), mass, exact, largest,
                                FieldScaling::kAsGiven);
  }
  made.validation = set.validation.project(made.basis);
  made.error = mean_error_by_size(made.validation, made.validation.q);
  return made;
}

/// Columns that could be used of a candidate.
Eigen::Index useful_size(const Candidate& candidate, const ModelOptions& options) {
  if (options.basis_size > 0) return candidate.basis.cols();
  const int enough = smallest_size(candidate.error, kEnough * options.tolerance);
  return enough > 0 ? enough : candidate.basis.cols();
}

std::vector<BasisKind> kinds_to_build(const BasisInput& input) {
  if (input.options.basis != BasisKind::kBest) return {input.options.basis};
  const Eigen::Index rows = input.modes.modes.rows();
  // Derivatives of a few pairs only would lose to the snapshots.
  const bool worth = affordable_pairs(rows, input.modes.rigid_count) >= 2 * input.modes.count();
  if (!worth) return {BasisKind::kSnapshots};
  return {BasisKind::kSnapshots, BasisKind::kMapDerivatives};
}

}  // namespace

Eigen::MatrixXd stvk_fields(const bodies::ElasticBody& body, const bodies::ModalBasis& basis,
                            const JobContext& job) {
  const int rigid = basis.rigid_count, all = static_cast<int>(basis.modes.cols());
  int columns = std::min(all, rigid + kLeadingModes);
  std::vector<bodies::ModePair> pairs = all_pairs(rigid, columns);
  while (columns > rigid + 1 &&
         static_cast<Eigen::Index>(pairs.size()) > affordable_pairs(basis.modes.rows(), rigid)) {
    pairs = all_pairs(rigid, --columns);
  }
  const int reference = reference_mode(all, rigid, basis.mechanism_count);
  const double lowest = basis.eigenvalues[reference];
  // A rotation goes by radians like a mode of the first frequency goes by its amplitude.
  const auto weight = [&](int k) { return lowest / std::max(lowest, basis.eigenvalues[k]); };
  Eigen::MatrixXd derivatives = bodies::modal_derivatives(body, basis, pairs, job);
  for (Eigen::Index i = 0; i < derivatives.cols(); ++i)
    derivatives.col(i) *= weight(pairs[i].first) * weight(pairs[i].second);
  Eigen::MatrixXd modes = basis.modes.middleCols(rigid, columns - rigid);
  for (Eigen::Index k = 0; k < modes.cols(); ++k)
    modes.col(k) *= weight(rigid + static_cast<int>(k));
  return beside(modes, derivatives);
}

Eigen::MatrixXd map_fields(const ScaledModes& modes, const FullReconstruction& full,
                           const Eigen::MatrixXd& z, const Eigen::VectorXd& norm,
                           const JobContext& job) {
  const int rigid = modes.rigid_count;
  const Eigen::ArrayXXd squares = z.array().square();
  const Eigen::ArrayXd inverse = norm.array().square().inverse();
  // Root mean squares over the poses.
  const auto of_mode = [&](int k) {
    return std::sqrt((squares.row(k).transpose() * inverse).mean());
  };
  const auto of_pair = [&](const bodies::ModePair& pair) {
    const double half = pair.first == pair.second ? 0.5 : 1;
    const auto product = squares.row(pair.first) * squares.row(pair.second);
    return half * std::sqrt((product.transpose() * inverse).mean());
  };
  std::vector<bodies::ModePair> pairs = all_pairs(rigid, modes.count());
  const Eigen::RowVectorXd size = modes.modes.colwise().norm();
  std::vector<double> importance(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    importance[i] = of_pair(pairs[i]) * size[pairs[i].first] * size[pairs[i].second];
  std::vector<int> order(pairs.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return importance[a] > importance[b]; });
  const auto count = std::min<Eigen::Index>(static_cast<Eigen::Index>(pairs.size()),
                                            affordable_pairs(modes.modes.rows(), rigid));
  std::vector<bodies::ModePair> taken;
  for (Eigen::Index i = 0; i < count; ++i) taken.push_back(pairs[order[i]]);

  Eigen::MatrixXd derivatives = full.second_derivatives(modes.modes, taken, job);
  for (Eigen::Index i = 0; i < count; ++i) derivatives.col(i) *= of_pair(taken[i]);
  Eigen::MatrixXd elastic = modes.modes.rightCols(modes.elastic_count());
  for (int k = 0; k < modes.elastic_count(); ++k) elastic.col(k) *= of_mode(rigid + k);
  return beside(elastic, derivatives);
}

BasisChoice choose_basis(const BasisInput& input, ModelReport& report, const JobContext& job) {
  const Eigen::MatrixXd exact = exact_fields(input);
  std::vector<Candidate> candidates;
  for (const BasisKind kind : kinds_to_build(input))
    candidates.push_back(make_candidate(input, exact, kind, {job.cancellation, {}}));

  // At the size that the first of them needs, so that none is judged by columns it has no use for.
  Eigen::Index size = candidates.front().basis.cols();
  for (const Candidate& candidate : candidates)
    size = std::min(size, useful_size(candidate, input.options));
  report.compared_size = static_cast<int>(size);
  const auto error = [&](const Candidate& candidate) { return candidate.error[size - 1]; };
  for (const Candidate& candidate : candidates) {
    (candidate.kind == BasisKind::kSnapshots ? report.snapshot_basis_error
                                             : report.derivative_basis_error) = error(candidate);
  }
  Candidate& best = *std::min_element(
      candidates.begin(), candidates.end(),
      [&](const Candidate& a, const Candidate& b) { return error(a) < error(b); });
  report.basis = best.kind;
  const Eigen::Index useful = useful_size(best, input.options);
  BasisChoice choice{best.basis.leftCols(useful), std::move(best.validation)};
  choice.validation.q = choice.validation.q.topRows(useful).eval();
  return choice;
}

}  // namespace limber::reduced
