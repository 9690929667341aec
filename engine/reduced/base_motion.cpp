#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

BaseMotion base_motion(const bodies::ElasticBody& body, const ReducedModel& model,
                       const Eigen::Ref<const Eigen::MatrixXd>& displacements) {
  const Eigen::Index rows = 3 * Eigen::Index{model.node_count};
  if (displacements.rows() != rows || body.mesh.node_count() != model.node_count) {
    throw Error(ErrorCode::kInvalidArgument, "base_motion",
                fmt::format("base motion has {} rows and the body {} nodes, the model has {} nodes",
                            displacements.rows(), body.mesh.node_count(), model.node_count));
  }
  for (Eigen::Index frame = 0; frame < displacements.cols(); ++frame) {
    if (!displacements.col(frame).allFinite()) {
      throw Error(
          ErrorCode::kInvalidArgument, fmt::format("base_motion[{}]", frame),
          fmt::format("frame {} of the base motion has a displacement that is not finite", frame));
    }
  }

  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  BaseMotion result;
  result.rs.resize(kRsSize * Eigen::Index{model.cubature_size()}, displacements.cols());
  // The whole mesh is needed: branches of the rotations are found from neighbour to neighbour and
  // frame to frame.
  Eigen::VectorXd y;
  for (Eigen::Index frame = 0; frame < displacements.cols(); ++frame) {
    y = frame == 0 ? inverse.coordinates(displacements.col(0))
                   : inverse.coordinates(displacements.col(frame), y);
    for (int t = 0; t < model.cubature_size(); ++t) {
      result.rs.col(frame).segment<kRsSize>(kRsSize * t) =
          y.segment<kRsSize>(kRsSize * Eigen::Index{model.tets[t]});
    }
  }

  // What H g(y_base) misses of the base motion as B sees it, translation of a free body included:
  // with z = 0 the model gives back the base motion's own projection.
  result.direct.noalias() = model.basis.transpose() * displacements;
  Eigen::VectorXd g(result.rs.rows());
  for (Eigen::Index frame = 0; frame < displacements.cols(); ++frame) {
    for (int t = 0; t < model.cubature_size(); ++t) {
      const RsVector y_t = result.rs.col(frame).segment<kRsSize>(kRsSize * t);
      Eigen::Map<Eigen::Matrix3d>(g.data() + kRsSize * t) = displacement_gradient(y_t);
    }
    result.direct.col(frame) -= model.map * g;
  }
  return result;
}

}  // namespace limber::reduced
