#include "engine/session/beams/beam_analysis.h"

#include <utility>

#include "engine/beams/solver/equilibrium.h"

namespace limber::session {
namespace {

/// States as they come, thinned to every `stride`-th once there are too many.
class ShapeKeeper {
 public:
  explicit ShapeKeeper(int most) : most_(static_cast<std::size_t>(most)) {}

  void keep(const beams::BeamState& state) {
    if (most_ == 0 || seen_++ % stride_ != 0) return;
    if (shapes_.size() == most_) {
      thin();
      if ((seen_ - 1) % stride_ != 0) return;
      if (shapes_.size() == most_) shapes_.pop_back();  // only where one is all that is kept
    }
    shapes_.emplace_back(state.positions.cast<float>());
  }
  [[nodiscard]] std::vector<Eigen::Matrix3Xf> take() { return std::move(shapes_); }

 private:
  void thin() {
    std::vector<Eigen::Matrix3Xf> left;
    for (std::size_t i = 0; i < shapes_.size(); i += 2) left.push_back(std::move(shapes_[i]));
    shapes_ = std::move(left);
    stride_ *= 2;
  }

  std::size_t most_, seen_ = 0, stride_ = 1;
  std::vector<Eigen::Matrix3Xf> shapes_;
};

}  // namespace

BeamAnalysis analyse(beams::BeamModel model, const beams::BeamSolveOptions& options, int shapes,
                     const JobContext& job) {
  beams::BeamStructure structure(std::move(model));
  ShapeKeeper keeper(shapes);
  beams::BeamSolution solution =
      find_equilibrium(structure, options, job,
                       [&](const beams::BeamProgress& progress) { keeper.keep(*progress.state); });
  job.throw_if_cancelled();
  beams::BeamResults results = results_of(structure, solution.state);
  return {std::move(structure), std::move(solution), std::move(results), keeper.take()};
}

}  // namespace limber::session
