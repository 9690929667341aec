#include "engine/reduced/model_enrichment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/reduced/cubature.h"
#include "engine/reduced/fitted_cubature.h"
#include "engine/reduced/pose_sampling.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/training_set.h"

namespace limber::reduced {
namespace {

using Eigen::Index;

// Sizes of the frames that the maps see: the neighbourhood that the next edits lead to.
constexpr double kScales[] = {0.7, 1, 1.3};
constexpr double kWeights[] = {0.1, 0.3, 1, 3};
// Held-out random poses may get worse by this factor.
constexpr double kAllowedLoss = 1.25;
// The basis is to leave this share of the tolerance; the maps need the rest.
constexpr double kBasisShare = 0.3;
constexpr int kPool = 400;             // tets that further ones are chosen from
constexpr Index kFramesAtOnce = 64;    // reconstructed at once: bounds memory
constexpr std::uint64_t kStream = 77;  // of random numbers, beside those of builds
constexpr double kRounding = 1e-12;

Eigen::MatrixXd reconstruct(const ReducedModel& model, const FullReconstruction& full,
                            const Eigen::MatrixXd& z, const JobContext& job) {
  Eigen::MatrixXd u(model.modes.rows(), z.cols());
  for (Index first = 0; first < z.cols(); first += kFramesAtOnce) {
    const Index count = std::min(kFramesAtOnce, z.cols() - first);
    u.middleCols(first, count) = full.from_linear(model.modes * z.middleCols(first, count), job);
  }
  return u;
}

/// Principal components of what the basis misses of u: as many as leave less than `limit` of u,
/// relative, or `most`.
Eigen::MatrixXd new_columns(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& u, double limit,
                            int most) {
  Eigen::MatrixXd rest = u;
  // Twice: columns stay orthogonal to the basis to rounding.
  for (int pass = 0; pass < 2; ++pass) rest -= basis * (basis.transpose() * rest).eval();
  const double whole = u.squaredNorm();
  const SymmetricEigen gram(rest.transpose() * rest);
  const Eigen::VectorXd& values = gram.eigenvalues();
  double left = rest.squaredNorm();
  Index count = 0;
  const Index room = std::min<Index>(most, std::min(values.size(), basis.rows() - basis.cols()));
  while (count < room && left > limit * limit * whole &&
         values[values.size() - 1 - count] > kRounding * whole) {
    left -= values[values.size() - 1 - count];
    ++count;
  }
  Eigen::MatrixXd columns = rest * gram.eigenvectors().rightCols(count).rowwise().reverse();
  if (count == 0) return columns;
  for (int pass = 0; pass < 2; ++pass) {
    columns -= basis * (basis.transpose() * columns).eval();
    orthonormalise_columns(columns);
  }
  return columns;
}

/// The model with `columns` behind its basis, which its maps do not use beyond first order.
ReducedModel extended(const ReducedModel& model, const Eigen::MatrixXd& columns) {
  ReducedModel result = model;
  const Index before = model.basis.cols(), added = columns.cols();
  result.basis.conservativeResize(Eigen::NoChange, before + added);
  result.basis.rightCols(added) = columns;
  result.map.conservativeResize(before + added, Eigen::NoChange);
  result.map.bottomRows(added).setZero();
  result.direct.conservativeResize(before + added, Eigen::NoChange);
  result.direct.bottomRows(added) = columns.transpose() * model.modes;
  return result;
}

/// r(y) of each tet over poses, side by side: S x 9T.
Eigen::MatrixXd features_of(const Eigen::MatrixXd& rs_modes, const Eigen::MatrixXd& z) {
  Eigen::MatrixXd features(z.cols(), rs_modes.rows());
  parallel_for(rs_modes.rows() / kRsSize, 8, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t t = begin; t < end; ++t)
      features.middleCols<kRsSize>(kRsSize * t) =
          remainder_features(rs_modes.middleRows<kRsSize>(kRsSize * t), z);
  });
  return features;
}

/// Tets of a free body turn together: corrections of their maps are to add up to nothing, which
/// they do where features have no mean over the tets.
void take_off_mean(Eigen::MatrixXd& features) {
  const Index tets = features.cols() / kRsSize;
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(features.rows(), kRsSize);
  for (Index t = 0; t < tets; ++t) mean += features.middleCols<kRsSize>(kRsSize * t);
  mean /= static_cast<double>(tets);
  for (Index t = 0; t < tets; ++t) features.middleCols<kRsSize>(kRsSize * t) -= mean;
}

/// Poses that the fit sees or is judged by, weighted so that errors are relative.
struct FitData {
  PoseData poses;
  Eigen::VectorXd weight;    // S
  Eigen::MatrixXd target;    // S x h: q less that of the extended model
  Eigen::MatrixXd features;  // S x 9T
};

/// Root mean square error where `corrected` is added to q, relative to that of the displacements.
double rms_error(const FitData& data, const Eigen::MatrixXd& corrected) {
  const double whole = data.poses.norm.squaredNorm();
  if (whole == 0) return 0;
  const double outside = std::max(0.0, whole - data.poses.q.squaredNorm());
  return std::sqrt(((data.target - corrected).squaredNorm() + outside) / whole);
}

/// Mean of the relative errors of the poses.
double mean_error(const FitData& data, const Eigen::MatrixXd& corrected) {
  const Eigen::ArrayXd norm2 = data.poses.norm.array().square();
  const Eigen::ArrayXd outside =
      (norm2 - data.poses.q.colwise().squaredNorm().transpose().array()).max(0.0);
  const Eigen::ArrayXd inside = (data.target - corrected).rowwise().squaredNorm().array();
  return ((outside + inside) / norm2).sqrt().mean();
}

/// How poses count in a fit: random ones each relative to itself, the frames of a motion relative
/// to the motion, as its error is.
enum class Weighting { kEach, kTogether };

FitData data_of(const ReducedModel& model, PoseData poses, Weighting weighting) {
  FitData data;
  data.poses = std::move(poses);
  const Eigen::VectorXd& norm = data.poses.norm;
  const double mean = std::sqrt(norm.squaredNorm() / static_cast<double>(norm.size()));
  if (weighting == Weighting::kTogether)
    data.weight.setConstant(norm.size(), mean > 0 ? 1 / mean : 0);
  else
    data.weight = norm.cwiseMax(kRounding * mean).cwiseInverse();
  data.target =
      (data.poses.q - reduced_coordinates(model.rs_modes, model.map, model.direct, data.poses.z))
          .transpose();
  return data;
}

/// Tets of a random pool whose features take most off what is left of the targets, one after the
/// other.
std::vector<int> further_tets(const bodies::GradientOperator& gradient, const ReducedModel& model,
                              const FitData& frames, int count, Random& random,
                              const JobContext& job) {
  std::vector<int> pool;
  std::vector<char> is_taken(static_cast<std::size_t>(gradient.tet_count()), 0);
  for (const int tet : model.tets) is_taken[static_cast<std::size_t>(tet)] = 1;
  const int free = gradient.tet_count() - model.cubature_size();
  while (static_cast<int>(pool.size()) < std::min(kPool, free)) {
    const auto tet =
        static_cast<int>(random.index(static_cast<std::uint64_t>(gradient.tet_count())));
    if (is_taken[static_cast<std::size_t>(tet)]++ == 0) pool.push_back(tet);
  }
  std::sort(pool.begin(), pool.end());
  Eigen::MatrixXd features =
      frames.weight.asDiagonal() *
      features_of(linear_coordinates(gradient, pool, model.modes), frames.poses.z);
  Eigen::MatrixXd residual = frames.weight.asDiagonal() * frames.target;
  const double noise =
      1e-6 * features.squaredNorm() / static_cast<double>(std::max<Index>(1, features.cols()));
  std::vector<int> chosen;
  while (static_cast<int>(chosen.size()) < std::min<int>(count, static_cast<int>(pool.size()))) {
    job.throw_if_cancelled();
    const Eigen::MatrixXd along = features.transpose() * residual;
    Index best = -1;
    double best_score = 0;
    Eigen::MatrixXd best_direction;
    for (Index c = 0; c < static_cast<Index>(pool.size()); ++c) {
      const auto phi = features.middleCols<kRsSize>(kRsSize * c);
      const SymmetricEigen gram(phi.transpose() * phi);
      const Eigen::VectorXd scale = (gram.eigenvalues().array().max(0.0) + noise).sqrt().inverse();
      const double score = (scale.asDiagonal() * gram.eigenvectors().transpose() *
                            along.middleRows<kRsSize>(kRsSize * c))
                               .squaredNorm();
      if (score <= best_score) continue;
      best_score = score;
      best = c;
    }
    if (best < 0) break;
    chosen.push_back(pool[static_cast<std::size_t>(best)]);
    const Eigen::MatrixXd phi = features.middleCols<kRsSize>(kRsSize * best);
    const SymmetricEigen gram(phi.transpose() * phi);
    Index kept = 0;
    while (kept < kRsSize && gram.eigenvalues()[kRsSize - 1 - kept] > noise) ++kept;
    const Eigen::MatrixXd direction =
        phi * (gram.eigenvectors().rightCols(kept) *
               gram.eigenvalues().tail(kept).cwiseSqrt().cwiseInverse().asDiagonal());
    residual -= direction * (direction.transpose() * residual).eval();
    features -= direction * (direction.transpose() * features).eval();
  }
  return chosen;
}

void add_tets(const bodies::GradientOperator& gradient, const std::vector<int>& tets,
              ReducedModel& model) {
  if (tets.empty()) return;
  const Index before = model.map.cols();
  const Index added = kRsSize * static_cast<Index>(tets.size());
  model.tets.insert(model.tets.end(), tets.begin(), tets.end());
  model.rs_modes.conservativeResize(before + added, Eigen::NoChange);
  model.rs_modes.bottomRows(added) = linear_coordinates(gradient, tets, model.modes);
  model.map.conservativeResize(Eigen::NoChange, before + added);
  model.map.rightCols(added).setZero();
}

/// q gets `delta` r(y): q = H g(y) + D z with H + delta and D less what delta makes of y to first
/// order.
void correct_maps(const Eigen::MatrixXd& delta, ReducedModel& model) {
  model.map += delta;
  for (Index first = 0; first < delta.cols(); first += kRsSize) {
    Eigen::MatrixXd linear(kRsSize, model.modes.cols());
    for (Index k = 0; k < linear.cols(); ++k) {
      const RsVector y = model.rs_modes.col(k).segment<kRsSize>(first);
      Eigen::Map<Eigen::Matrix3d>(linear.col(k).data()) = linear_gradient(y);
    }
    model.direct.noalias() -= delta.middleCols<kRsSize>(first) * linear;
  }
}

/// Ridge regression in the space of poses, which are fewer than features:
///   delta^T = F^T (F F^T + ridge I)^-1 T, F and T weighted rows.
struct Fit {
  Eigen::MatrixXd delta;  // h x 9T; empty: none
  double weight = 0;
};

struct FitInput {
  const FitData &frames, &kept;         // to fit
  const FitData &other_frames, &other;  // to judge by
  double before = 0, other_before = 0;  // their errors as they are
};

Fit best_fit(const FitInput& in, const JobContext& job) {
  Fit best;
  double best_error = in.before;
  const Index frames = in.frames.target.rows(), kept = in.kept.target.rows();
  Eigen::MatrixXd features(frames + kept, in.frames.features.cols());
  Eigen::MatrixXd target(frames + kept, in.frames.target.cols());
  for (const double weight : kWeights) {
    job.throw_if_cancelled();
    const double factor =
        std::sqrt(weight * static_cast<double>(kept) / static_cast<double>(frames));
    features.topRows(frames) = factor * in.frames.weight.asDiagonal() * in.frames.features;
    target.topRows(frames) = factor * in.frames.weight.asDiagonal() * in.frames.target;
    features.bottomRows(kept) = in.kept.weight.asDiagonal() * in.kept.features;
    target.bottomRows(kept) = in.kept.weight.asDiagonal() * in.kept.target;
    const SymmetricEigen gram(features * features.transpose());
    const Eigen::VectorXd values = gram.eigenvalues().cwiseMax(0.0);
    const double largest = values.maxCoeff();
    if (!(largest > 0)) continue;
    const Eigen::MatrixXd right = gram.eigenvectors().transpose() * target;
    // Judged without the maps themselves: F' F^T, once a weight.
    const Eigen::MatrixXd frame_probe =
        (in.other_frames.features * features.transpose()) * gram.eigenvectors();
    const Eigen::MatrixXd other_probe =
        (in.other.features * features.transpose()) * gram.eigenvectors();
    for (int exponent = -18; exponent <= -2; ++exponent) {
      const double ridge = std::pow(10.0, 0.5 * exponent);
      const Eigen::VectorXd inverse = (values.array() + ridge * largest).inverse();
      const Eigen::MatrixXd scaled = inverse.asDiagonal() * right;
      const double error = rms_error(in.other_frames, frame_probe * scaled);
      if (error >= best_error) continue;
      if (mean_error(in.other, other_probe * scaled) > kAllowedLoss * in.other_before) continue;
      best_error = error;
      best.weight = weight;
      best.delta = (features.transpose() * (gram.eigenvectors() * scaled)).transpose();
    }
  }
  return best;
}

ScaledModes modes_of(const ReducedModel& model) {
  return {model.eigenvalues, model.modes, model.rigid_count, model.mechanism_count};
}

PoseData part_of(const PoseData& poses, Index first, Index stride) {
  std::vector<Index> columns;
  for (Index i = first; i < poses.z.cols(); i += stride) columns.push_back(i);
  return {poses.z(Eigen::all, columns), poses.q(Eigen::all, columns), poses.norm(columns)};
}

}  // namespace

void EnrichmentOptions::validate() const {
  const auto refuse = [](const char* member, const std::string& why) {
    throw Error(ErrorCode::kInvalidArgument, member, why);
  };
  if (!(tolerance > 0 && tolerance < 1)) refuse("tolerance", "must be in (0, 1)");
  if (max_columns < 0) refuse("max_columns", "must be >= 0");
  if (tets < 0) refuse("tets", "must be >= 0");
  if (kept_poses < 20) refuse("kept_poses", "must be >= 20");
  if (!(amplitude > 0 && amplitude <= 10)) refuse("amplitude", "must be in (0, 10]");
}

EnrichedModel enrich_model(const bodies::ElasticBody& body, const ReducedModel& model,
                           const FullReconstruction& full,
                           const Eigen::Ref<const Eigen::MatrixXd>& z,
                           const EnrichmentOptions& options, const JobContext& job) {
  options.validate();
  if (z.rows() != model.coordinate_count() || z.cols() == 0 || !z.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "z",
                fmt::format("frames of {} finite modal coordinates are expected, not {} x {}",
                            model.coordinate_count(), z.rows(), z.cols()));
  }
  LIMBER_DEMAND(body.mesh.node_count() == model.node_count);
  EnrichedModel result;
  EnrichmentReport& report = result.report;
  job.report("frames of the motion", 0);
  const Index frames = z.cols(), scales = std::size(kScales);
  Eigen::MatrixXd all_z(z.rows(), frames * scales);
  for (Index s = 0; s < scales; ++s) all_z.middleCols(frames * s, frames) = kScales[s] * z;
  const Snapshots motion{all_z, reconstruct(model, full, all_z, job)};
  const Snapshots itself{z, motion.u.middleCols(frames, frames)};
  if (itself.u.squaredNorm() == 0) {  // at rest: nothing to learn
    result.model = model;
    return result;
  }
  {
    const FitData now = data_of(model, itself.project(model.basis), Weighting::kTogether);
    report.error_before =
        rms_error(now, Eigen::MatrixXd::Zero(now.target.rows(), now.target.cols()));
  }

  const Eigen::MatrixXd columns =
      new_columns(model.basis, itself.u, kBasisShare * options.tolerance, options.max_columns);
  result.model = extended(model, columns);
  report.columns = static_cast<int>(columns.cols());

  job.report("random poses", 0.2);
  Random random(options.seed * 1000003 + kStream);
  const int held_out = std::max(20, options.kept_poses / 3);
  const Eigen::MatrixXd random_z =
      sample_poses(modes_of(model), model.length, options.amplitude, PoseLevels::kTraining,
                   options.kept_poses + held_out, random);
  const Snapshots kept{random_z, reconstruct(model, full, random_z, job.part(0.2, 0.7))};
  const PoseData kept_poses = kept.project(result.model.basis);

  job.report("maps", 0.7);
  const PoseData motion_poses = motion.project(result.model.basis);
  FitData every_frame = data_of(result.model, motion_poses, Weighting::kTogether);
  const std::vector<int> tets =
      further_tets(full.gradient(), result.model, every_frame, options.tets, random, job);
  add_tets(full.gradient(), tets, result.model);
  report.tets = static_cast<int>(tets.size());

  // Every third frame is left out to choose by; with few of them all are seen by both.
  const bool is_split = frames >= 6;
  const auto of_set = [&](const PoseData& poses, Weighting weighting) {
    FitData data = data_of(result.model, poses, weighting);
    data.features = features_of(result.model.rs_modes, data.poses.z);
    if (model.rigid_count > 0) take_off_mean(data.features);
    return data;
  };
  PoseData fitted = motion_poses, judged = itself.project(result.model.basis);
  if (is_split) {
    std::vector<Index> in, out;
    for (Index i = 0; i < motion_poses.z.cols(); ++i) (i % frames % 3 == 1 ? out : in).push_back(i);
    fitted = {motion_poses.z(Eigen::all, in), motion_poses.q(Eigen::all, in),
              motion_poses.norm(in)};
    judged = part_of(judged, 1, 3);
  }
  std::vector<Index> first, last;
  for (Index i = 0; i < kept_poses.z.cols(); ++i)
    (i < options.kept_poses ? first : last).push_back(i);
  const FitData fit_frames = of_set(fitted, Weighting::kTogether),
                other_frames = of_set(judged, Weighting::kTogether);
  const FitData fit_kept = of_set(
      {kept_poses.z(Eigen::all, first), kept_poses.q(Eigen::all, first), kept_poses.norm(first)},
      Weighting::kEach);
  const FitData other_kept = of_set(
      {kept_poses.z(Eigen::all, last), kept_poses.q(Eigen::all, last), kept_poses.norm(last)},
      Weighting::kEach);
  const auto nothing = [](const FitData& data) {
    return Eigen::MatrixXd(Eigen::MatrixXd::Zero(data.target.rows(), data.target.cols()));
  };
  const double before = rms_error(other_frames, nothing(other_frames));
  report.kept_before = mean_error(other_kept, nothing(other_kept));
  const Fit fit =
      best_fit({fit_frames, fit_kept, other_frames, other_kept, before, report.kept_before}, job);
  if (fit.delta.size() > 0) correct_maps(fit.delta, result.model);
  report.weight = fit.weight;

  const PoseData after = itself.project(result.model.basis);
  report.basis_error = std::sqrt(std::max(0.0, after.norm.squaredNorm() - after.q.squaredNorm()) /
                                 after.norm.squaredNorm());
  const FitData now = data_of(result.model, after, Weighting::kTogether);
  report.error_after = rms_error(now, nothing(now));
  const FitData others = data_of(result.model, other_kept.poses, Weighting::kEach);
  report.kept_after = mean_error(others, nothing(others));
  job.report("done", 1);
  return result;
}

}  // namespace limber::reduced
