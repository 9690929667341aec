#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

namespace {

// Frames that are projected at once: bounds how long a cancellation is not heard.
constexpr Eigen::Index kFramesAtOnce = 64;

// Share of the work that is finding RS coordinates.
constexpr double kInverseShare = 0.9;

/// The RS coordinates of the cubature tets, 9T x N. Those of all tets in a frame go to the load,
/// too.
Eigen::MatrixXd cubature_coordinates(const bodies::ElasticBody& body, const ReducedModel& model,
                                     const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                                     BaseLoadSum& load, const JobContext& job) {
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  Eigen::MatrixXd rs(kRsSize * Eigen::Index{model.cubature_size()}, displacements.cols());
  // The whole mesh is needed: branches of the rotations are found from neighbour to neighbour and
  // frame to frame.
  RsTrack track;
  for (Eigen::Index frame = 0; frame < displacements.cols(); ++frame) {
    job.report("base motion",
               static_cast<double>(frame) / static_cast<double>(displacements.cols()));
    const Eigen::VectorXd y = inverse.coordinates(displacements.col(frame), track);
    load.add(frame, y);
    for (int t = 0; t < model.cubature_size(); ++t) {
      rs.col(frame).segment<kRsSize>(kRsSize * t) =
          y.segment<kRsSize>(kRsSize * Eigen::Index{model.tets[t]});
    }
  }
  return rs;
}

}  // namespace

ReducedModel with_columns(ReducedModel model, const Eigen::Ref<const Eigen::MatrixXd>& columns) {
  LIMBER_DEMAND(columns.rows() == model.basis.rows());
  const Eigen::Index before = model.basis.cols(), added = columns.cols();
  model.basis.conservativeResize(Eigen::NoChange, before + added);
  model.basis.rightCols(added) = columns;
  for (Eigen::MatrixXd* of_basis : {&model.map, &model.direct}) {
    of_basis->conservativeResize(before + added, Eigen::NoChange);
    of_basis->bottomRows(added).setZero();
  }
  return model;
}

BaseMotion base_motion(const bodies::ElasticBody& body, const ReducedModel& model,
                       const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                       const JobContext& job) {
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

  BaseMotion result;
  BaseLoadSum load(body, model.modes, model.rigid_count + model.mechanism_count, displacements);
  result.rs = cubature_coordinates(body, model, displacements, load, job.part(0, kInverseShare));
  result.load = load.load();

  // The difference between the base motion's projection on B and H g(y_base), with the translation
  // of a free body. With z = 0 the model thus gives the base motion's own projection.
  const Eigen::Index count = displacements.cols();
  result.direct.resize(model.basis_size(), count);
  Eigen::VectorXd g(result.rs.rows());
  for (Eigen::Index first = 0; first < count; first += kFramesAtOnce) {
    job.report("base motion", kInverseShare + (1 - kInverseShare) * static_cast<double>(first) /
                                                  static_cast<double>(count));
    const Eigen::Index frames = std::min(kFramesAtOnce, count - first);
    result.direct.middleCols(first, frames).noalias() =
        model.basis.transpose() * displacements.middleCols(first, frames);
    for (Eigen::Index frame = first; frame < first + frames; ++frame) {
      for (int t = 0; t < model.cubature_size(); ++t) {
        const RsVector y_t = result.rs.col(frame).segment<kRsSize>(kRsSize * t);
        Eigen::Map<Eigen::Matrix3d>(g.data() + kRsSize * t) = displacement_gradient(y_t);
      }
      result.direct.col(frame) -= model.map * g;
    }
  }
  job.report("base motion", 1);
  return result;
}

}  // namespace limber::reduced
