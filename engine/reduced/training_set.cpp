#include "engine/reduced/training_set.h"

#include <algorithm>

#include "engine/base/parallel.h"
#include "engine/reduced/pose_sampling.h"

namespace limber::reduced {

PoseData Snapshots::project(const Eigen::MatrixXd& basis) const {
  PoseData poses{z, Eigen::MatrixXd(basis.cols(), u.cols()), u.colwise().norm()};
  constexpr Eigen::Index kColumns = 32;
  parallel_for((u.cols() + kColumns - 1) / kColumns, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t block = begin; block < end; ++block) {
      const Eigen::Index first = block * kColumns, n = std::min(kColumns, u.cols() - first);
      poses.q.middleCols(first, n).noalias() = basis.transpose() * u.middleCols(first, n);
    }
  });
  return poses;
}

TrainingSet make_training_set(const bodies::ElasticBody& body, const ScaledModes& modes,
                              const FullReconstruction& full, const ModelOptions& options,
                              const JobContext& job) {
  const double length = body.length();
  const auto make = [&](PoseLevels levels, int count, std::uint64_t stream, double from,
                        double to) {
    job.report("poses", from);
    Random random(options.seed * 1000003 + stream);
    Snapshots set;
    set.z = sample_poses(modes, length, options.amplitude, levels, count, random);
    set.u.resize(modes.modes.rows(), count);
    // By blocks, so that the linear poses never need memory of their own size, and to hear of a
    // cancellation.
    constexpr int kBlock = 128;
    for (int first = 0; first < count; first += kBlock) {
      const int n = std::min(kBlock, count - first);
      set.u.middleCols(first, n) = full.from_linear(modes.modes * set.z.middleCols(first, n), job);
      job.report("poses", from + (to - from) * (first + n) / count);
    }
    return set;
  };
  const int small = std::clamp(options.test_poses / 4, 10, 50);
  TrainingSet result;
  result.train = make(PoseLevels::kTraining, options.training_poses, 1, 0.0, 0.6);
  result.validation = make(PoseLevels::kTest, options.test_poses, 2, 0.6, 0.75);
  result.test = make(PoseLevels::kTest, options.test_poses, 3, 0.75, 0.9);
  result.small = make(PoseLevels::kSmall, small, 4, 0.9, 1.0);
  return result;
}

}  // namespace limber::reduced
