#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/reduced/added_poses.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {

class BaseCoordinates;

/// Full reconstructions of the motions of a reduced model: the same modal coordinates, over the
/// same base motion, without basis and cubature. One scalar Laplacian is factored by the
/// constructor. RS coordinates of base frames are computed on first request, in the order of
/// frames, and some of them are kept. Not thread-safe; the work itself uses all threads.
class FullShapes {
 public:
  /// @param body  that the model was built of
  /// @param base  displacements of the base motion, 3n x N [m]; empty: none
  FullShapes(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
             Eigen::MatrixXd base = {});
  /// With the body's reconstruction made already.
  FullShapes(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
             std::shared_ptr<const FullReconstruction> reconstruction, Eigen::MatrixXd base = {});
  ~FullShapes();
  FullShapes(FullShapes&&) noexcept;
  FullShapes& operator=(FullShapes&&) noexcept;

  [[nodiscard]] const ReducedModel& model() const { return *model_; }
  [[nodiscard]] const bodies::GradientOperator& gradient() const { return full_->gradient(); }

  /// Poses on top of the base motion; null: none.
  void set_added(std::shared_ptr<const AddedPoses> added) { added_ = std::move(added); }

  /// @param frames  ascending; of the base motion, if there is one in [0, N)
  /// @param linear  W-hat z, a column a frame, 3n x k [m]
  /// @returns displacements from rest, base motion included, 3n x k [m]
  /// @throws Error{kCancelled}
  [[nodiscard]] Eigen::MatrixXd displacements(std::span<const int> frames,
                                              const Eigen::Ref<const Eigen::MatrixXd>& linear,
                                              const JobContext& job = {});

 private:
  std::shared_ptr<const ReducedModel> model_;
  std::shared_ptr<const FullReconstruction> full_;
  std::unique_ptr<BaseCoordinates> base_;  // null: no base motion
  Eigen::MatrixXd lift_;                   // of its pins, 3n x N; empty: they do not move
  std::shared_ptr<const AddedPoses> added_;
};

}  // namespace limber::reduced
