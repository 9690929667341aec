#include "engine/reduced/training_set.h"

#include <algorithm>

#include "engine/base/parallel.h"
#include "engine/reduced/pose_sampling.h"

namespace limber::reduced {

PoseData Snapshots::project(const Eigen::MatrixXd& basis) const {
  PoseData poses{z, Eigen::MatrixXd(basis.cols(), u.cols()), u.colwise().norm()};
  constexpr Eigen::Index kColumns = 32;  // poses of one parallel chunk
  parallel_for((u.cols() + kColumns - 1) / kColumns, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t block = begin; block < end; ++block) {
      const Eigen::Index first = block * kColumns, n = std::min(kColumns, u.cols() - first);
      poses.q.middleCols(first, n).noalias() = basis.transpose() * u.middleCols(first, n);
    }
  });
  return poses;
}

namespace {

// Poses that are reconstructed at once: bounds memory, and how long a cancellation is not heard.
constexpr int kBlock = 128;
// Poses that a basis is made of. More poses hardly improve it, but the cost of its eigenproblem
// grows with the third power. Half as many make a frame of the model 1 to 5 % more costly (measured
// on seven bodies). Every pose of a large mesh needs a solve.
constexpr double kMaxBasisPoses = 800, kMinBasisPoses = 400;
constexpr double kTetsAtMaxBasisPoses = 8000;  // larger meshes get fewer

int basis_poses(int tet_count) {
  return static_cast<int>(std::clamp(kMaxBasisPoses * kTetsAtMaxBasisPoses / tet_count,
                                     kMinBasisPoses, kMaxBasisPoses));
}

// Models to smaller tolerances are fitted to poses in double precision.
constexpr double kDoubleBelow = 1e-4;

// Independent sequences of random numbers that one training set takes.
constexpr std::uint64_t kStreams = 4;

/// @param stream  from 1
Eigen::MatrixXd draw(const bodies::ElasticBody& body, const ScaledModes& modes,
                     const ModelOptions& options, PoseLevels levels, int count,
                     std::uint64_t stream) {
  Random random(options.seed * 1000003 + stream);
  return sample_poses(modes, body.length(), options.amplitude, levels, count, random);
}

Snapshots reconstruct(const ScaledModes& modes, const FullReconstruction& full, Eigen::MatrixXd z,
                      const JobContext& job) {
  Snapshots set{std::move(z), {}};
  set.u.resize(modes.modes.rows(), set.z.cols());
  for (Eigen::Index first = 0; first < set.z.cols(); first += kBlock) {
    job.report("poses", static_cast<double>(first) / static_cast<double>(set.z.cols()));
    const Eigen::Index n = std::min<Eigen::Index>(kBlock, set.z.cols() - first);
    set.u.middleCols(first, n) = full.from_linear(modes.modes * set.z.middleCols(first, n), job);
  }
  return set;
}

}  // namespace

int automatic_training_poses(int tet_count) {
  constexpr double kMaxPoses = 2400, kMinPoses = 600;
  constexpr double kTetsAtMaxPoses = 40000;  // larger meshes get fewer poses
  return static_cast<int>(
      std::clamp(kMaxPoses * kTetsAtMaxPoses / tet_count, kMinPoses, kMaxPoses));
}

TrainingSet make_training_set(const bodies::ElasticBody& body, const ScaledModes& modes,
                              const FullReconstruction& full, const ModelOptions& options,
                              const JobContext& job) {
  const auto sample = [&](PoseLevels levels, int count, std::uint64_t stream) {
    return draw(body, modes, options, levels, count, stream);
  };
  const int training = options.training_poses > 0 ? options.training_poses
                                                  : automatic_training_poses(body.mesh.tet_count());
  const Eigen::MatrixXd all = sample(PoseLevels::kTraining, training, 1);
  const Eigen::Index held = std::min<Eigen::Index>(all.cols(), basis_poses(body.mesh.tet_count()));
  const int small = std::clamp(options.test_poses / 4, 10, 50);

  TrainingSet result;
  result.more = all.rightCols(all.cols() - held);
  result.train = reconstruct(modes, full, all.leftCols(held), job.part(0.0, 0.6));
  // Sizes and the ridge are chosen by these: more of them than of test poses, so that the choice
  // holds for the latter.
  result.validation = reconstruct(modes, full, sample(PoseLevels::kTest, 2 * options.test_poses, 2),
                                  job.part(0.6, 0.8));
  result.test = reconstruct(modes, full, sample(PoseLevels::kTest, options.test_poses, 3),
                            job.part(0.8, 0.95));
  result.small =
      reconstruct(modes, full, sample(PoseLevels::kSmall, small, 4), job.part(0.95, 1.0));
  return result;
}

Snapshots further_test_poses(const bodies::ElasticBody& body, const ScaledModes& modes,
                             const FullReconstruction& full, const ModelOptions& options,
                             int attempt, const JobContext& job) {
  const auto stream = kStreams + static_cast<std::uint64_t>(attempt);
  return reconstruct(modes, full,
                     draw(body, modes, options, PoseLevels::kTest, options.test_poses, stream),
                     {job.cancellation, {}});
}

PoseData project_training(const TrainingSet& set, const ScaledModes& modes,
                          const FullReconstruction& full, const Eigen::MatrixXd& basis,
                          double tolerance, const JobContext& job) {
  const PoseData held = set.train.project(basis);
  const Eigen::Index first_count = held.z.cols(), count = first_count + set.more.cols();
  PoseData all{Eigen::MatrixXd(held.z.rows(), count), Eigen::MatrixXd(basis.cols(), count),
               Eigen::VectorXd(count)};
  all.z << held.z, set.more;
  all.q.leftCols(first_count) = held.q;
  all.norm.head(first_count) = held.norm;
  if (set.more.cols() == 0) return all;
  using Precision = FullReconstruction::Precision;
  const Precision precision = tolerance < kDoubleBelow ? Precision::kDouble : Precision::kSingle;
  const FullReconstruction::Adjoint adjoint = full.adjoint(basis);
  for (Eigen::Index first = 0; first < set.more.cols(); first += kBlock) {
    const Eigen::Index n = std::min<Eigen::Index>(kBlock, set.more.cols() - first);
    job.report("poses", static_cast<double>(first) / static_cast<double>(set.more.cols()));
    const Eigen::MatrixXd linear = modes.modes * set.more.middleCols(first, n);
    const Eigen::MatrixXd q =
        full.project_linear(adjoint, linear, precision, {job.cancellation, {}});
    all.q.middleCols(first_count + first, n) = q;
    // The norm is a weight of the fit: what the basis leaves of it does not matter.
    all.norm.segment(first_count + first, n) = q.colwise().norm();
  }
  return all;
}

}  // namespace limber::reduced
