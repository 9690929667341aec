#include "engine/reduced/full_shapes.h"

#include <algorithm>
#include <utility>

#include "engine/reduced/base_coordinates.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {

FullShapes::FullShapes(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
                       Eigen::MatrixXd base)
    : FullShapes(body, std::move(model), std::make_shared<const FullReconstruction>(body),
                 std::move(base)) {}

FullShapes::FullShapes(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
                       std::shared_ptr<const FullReconstruction> reconstruction,
                       Eigen::MatrixXd base)
    : model_(std::move(model)), full_(std::move(reconstruction)) {
  LIMBER_DEMAND(model_ != nullptr && model_->node_count == body.mesh.node_count());
  if (base.size() == 0) return;
  lift_ = full_->lift(base, body.fixed_nodes);
  base_ = std::make_unique<BaseCoordinates>(body, full_->gradient(), std::move(base));
}
FullShapes::~FullShapes() = default;
FullShapes::FullShapes(FullShapes&&) noexcept = default;
FullShapes& FullShapes::operator=(FullShapes&&) noexcept = default;

Eigen::MatrixXd FullShapes::displacements(std::span<const int> frames,
                                          const Eigen::Ref<const Eigen::MatrixXd>& linear,
                                          const JobContext& job) {
  LIMBER_DEMAND(linear.cols() == static_cast<Eigen::Index>(frames.size()));
  const auto is_added = [&](int frame) { return added_ && added_->act_in(frame); };
  if (!base_ && std::none_of(frames.begin(), frames.end(), is_added))
    return full_->from_linear(linear, job);
  const Eigen::VectorXd& share = full_->mass_share();
  Eigen::MatrixXd u(linear.rows(), linear.cols());
  constexpr Eigen::Index kAtOnce = 4;  // bounds memory, and how long a cancellation is not heard
  for (Eigen::Index first = 0; first < linear.cols(); first += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, linear.cols() - first);
    Eigen::MatrixXd y = linear_coordinates(full_->gradient(), linear.middleCols(first, count));
    for (Eigen::Index i = 0; i < count; ++i) {
      const int frame = frames[static_cast<std::size_t>(first + i)];
      if (base_) y.col(i) += base_->at(frame, job).cast<double>();
      if (added_) added_->add_to(frame, y.col(i));
    }
    job.throw_if_cancelled();
    u.middleCols(first, count) = full_->from_coordinates(y);
    for (Eigen::Index i = 0; i < count; ++i) {
      const int frame = frames[static_cast<std::size_t>(first + i)];
      if (lift_.size() > 0) u.col(first + i) += lift_.col(frame);
      if (added_) added_->add_beyond(frame, u.col(first + i));
    }
    if (share.size() == 0) continue;
    // The centre of mass goes where base motion and linear displacement take it together.
    for (Eigen::Index i = 0; i < count; ++i) {
      Eigen::VectorXd rigid = linear.col(first + i);
      if (base_) rigid += base_->motion().col(frames[static_cast<std::size_t>(first + i)]);
      const Eigen::Vector3d shift =
          Eigen::Map<const Eigen::Matrix3Xd>(rigid.data(), 3, share.size()) * share;
      Eigen::Map<Eigen::Matrix3Xd>(u.col(first + i).data(), 3, share.size()).colwise() += shift;
    }
  }
  return u;
}

}  // namespace limber::reduced
