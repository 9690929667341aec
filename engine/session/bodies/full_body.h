#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/reduced/frame_projection.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/full_shapes.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/problem_mapping.h"

namespace limber::session {

/// Parts of an unreduced body that do not depend on modes: made once, shared between threads.
struct BodyParts {
  /// Maps the mesh and factors its Laplacian.
  explicit BodyParts(const scene::Scene& scene);

  MappedBody mapped;
  Eigen::MatrixXd base;  // displacements of the base motion, 3n x N [m], or empty
  std::shared_ptr<const reduced::FullReconstruction> reconstruction;
};

/// A frame that is always reconstructed, and its held site, if any.
struct HeldFrame {
  int frame = 0;
  std::shared_ptr<const reduced::Site> site;  // null: of a keyframe
};

/// Which frames are reconstructed in full, and the basis they are shown through.
struct ShowOptions {
  double tolerance = 1e-3;  // of the shape error that the basis leaves
  int max_columns = 24;     // added at once
  int max_added = 48;       // beyond the model's own; more: the basis is made anew from these
  /// Tets times frames that are reconstructed: about 1 s on two cores. In longer motions, evenly
  /// spread frames are reconstructed; the model's error in the others is interpolated.
  double max_tet_frames = 2e7;
};

/// The body of a session without reduction: what the exact step and the frames that it shows need.
/// Driven by one thread.
class FullBody {
 public:
  FullBody(std::shared_ptr<const BodyParts> parts,
           std::shared_ptr<const reduced::ReducedModel> model);

  [[nodiscard]] const std::shared_ptr<const BodyParts>& parts() const { return parts_; }

  [[nodiscard]] std::unique_ptr<reduced::FullKinematics> make_kinematics() const;
  /// Poses that frames are shown with from now on; null: none.
  void set_added(std::shared_ptr<const reduced::AddedPoses> added) {
    shapes_->set_added(std::move(added));
  }

  struct Shown {
    std::shared_ptr<const Eigen::MatrixXd> basis;  // `before`, or that with new columns
    Eigen::MatrixXf coordinates;                   // h' x N
    double error = 0;  // that the basis leaves, relative, over the reconstructed frames
    int columns = 0;   // new ones
  };
  /// The frames of a motion by full reconstruction.
  /// @param modal  z-hat, R x N; @param reduced  q of the model itself, h x N
  /// @throws Error{kCancelled}
  [[nodiscard]] Shown show(const std::shared_ptr<const Eigen::MatrixXd>& before,
                           const Eigen::Ref<const Eigen::MatrixXd>& modal,
                           const Eigen::MatrixXf& reduced, const std::vector<HeldFrame>& held,
                           const ShowOptions& options, const JobContext& job);

 private:
  std::shared_ptr<const reduced::ReducedModel> model_;
  std::shared_ptr<const BodyParts> parts_;
  std::unique_ptr<reduced::FullShapes> shapes_;
};

}  // namespace limber::session
