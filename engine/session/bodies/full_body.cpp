#include "engine/session/bodies/full_body.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace limber::session {
namespace {

using Eigen::Index;

/// `count` frames evenly spread over the motion, its ends included, with those that must be there.
std::vector<int> frames_to_reconstruct(Index frames, double count,
                                       const std::vector<HeldFrame>& held) {
  std::vector<int> chosen;
  chosen.reserve(held.size());
  for (const HeldFrame& one : held) chosen.push_back(one.frame);
  const auto most = static_cast<Index>(std::max(2.0, std::min(count, double(frames))));
  for (Index i = 0; i < most; ++i)
    chosen.push_back(static_cast<int>(most > 1 ? i * (frames - 1) / (most - 1) : 0));
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

}  // namespace

BodyParts::BodyParts(const scene::Scene& scene) : mapped(map_body(scene)) {
  if (scene.base_motion.size() > 0) base = map_base_motion(scene, mapped.source_of_compact);
  reconstruction = std::make_shared<const reduced::FullReconstruction>(mapped.body);
}

FullBody::FullBody(std::shared_ptr<const BodyParts> parts,
                   std::shared_ptr<const reduced::ReducedModel> model)
    : model_(std::move(model)), parts_(std::move(parts)) {
  shapes_ = std::make_unique<reduced::FullShapes>(parts_->mapped.body, model_,
                                                  parts_->reconstruction, parts_->base);
}

std::unique_ptr<reduced::FullKinematics> FullBody::make_kinematics() const {
  return std::make_unique<reduced::FullKinematics>(parts_->mapped.body, model_,
                                                   parts_->reconstruction, parts_->base);
}

FullBody::Shown FullBody::show(const std::shared_ptr<const Eigen::MatrixXd>& before,
                               const Eigen::Ref<const Eigen::MatrixXd>& modal,
                               const Eigen::MatrixXf& reduced, const std::vector<HeldFrame>& held,
                               const ShowOptions& options, const JobContext& job) {
  const Index count = modal.cols(), own = model_->basis_size();
  LIMBER_DEMAND(reduced.rows() == own && reduced.cols() == count);
  const double affordable =
      options.max_tet_frames / std::max(1, parts_->reconstruction->gradient().tet_count());
  const std::vector<int> frames = frames_to_reconstruct(count, affordable, held);
  const Eigen::MatrixXd part = modal(Eigen::all, frames);
  std::vector<reduced::HeldSite> sites;
  for (const HeldFrame& one : held) {
    const auto at = std::lower_bound(frames.begin(), frames.end(), one.frame);
    if (one.site) sites.push_back({static_cast<int>(at - frames.begin()), one.site});
  }
  reduced::FrameProjectionOptions projection{options.tolerance, options.max_columns};
  Shown shown;
  shown.basis = before;
  reduced::ProjectedFrames projected =
      reduced::project_frames(*shapes_, *before, frames, part, sites, projection, job);
  if (before->cols() + projected.columns.cols() > own + options.max_added) {
    // Columns that no motion of late needs go: only those of this one come back.
    shown.basis = {model_, &model_->basis};
    projection.max_columns = options.max_added;
    projected =
        reduced::project_frames(*shapes_, *shown.basis, frames, part, sites, projection, job);
  }
  shown.error = projected.error_after;
  shown.columns = static_cast<int>(projected.columns.cols());
  if (shown.columns > 0) {
    auto basis =
        std::make_shared<Eigen::MatrixXd>(shown.basis->rows(), shown.basis->cols() + shown.columns);
    *basis << *shown.basis, projected.columns;
    shown.basis = std::move(basis);
  }
  // Between reconstructed frames what the model misses is interpolated.
  const Index size = shown.basis->cols();
  shown.coordinates.setZero(size, count);
  shown.coordinates.topRows(own) = reduced;
  Eigen::VectorXf left, right;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto column = static_cast<Index>(i);
    const auto missed = [&](Index of) -> Eigen::VectorXf {
      Eigen::VectorXf miss = projected.coordinates.col(of).cast<float>();
      miss.head(own) -= reduced.col(frames[static_cast<std::size_t>(of)]);
      return miss;
    };
    if (i > 0 && frames[i] > frames[i - 1] + 1) {
      left = missed(column - 1);
      right = missed(column);
      const int first = frames[i - 1], last = frames[i];
      for (int frame = first + 1; frame < last; ++frame) {
        const float share = static_cast<float>(frame - first) / static_cast<float>(last - first);
        shown.coordinates.col(frame) += (1 - share) * left + share * right;
      }
    }
  }
  for (std::size_t i = 0; i < frames.size(); ++i)
    shown.coordinates.col(frames[i]) =
        projected.coordinates.col(static_cast<Index>(i)).cast<float>();
  return shown;
}

}  // namespace limber::session
