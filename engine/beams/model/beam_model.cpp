#include "engine/beams/model/beam_model.h"

#include <Eigen/Geometry>

namespace limber::beams {

double drawn_length(const BeamModel& model, int element) {
  const BeamElement& e = model.elements[static_cast<std::size_t>(element)];
  return (model.nodes[static_cast<std::size_t>(e.finish)].position -
          model.nodes[static_cast<std::size_t>(e.start)].position)
      .norm();
}

Eigen::Matrix3d drawn_frame(const BeamModel& model, int element) {
  const BeamElement& e = model.elements[static_cast<std::size_t>(element)];
  const BeamNode& a = model.nodes[static_cast<std::size_t>(e.start)];
  const BeamNode& b = model.nodes[static_cast<std::size_t>(e.finish)];
  const Eigen::Vector3d normal =
      e.normal.isZero(0) ? (a.normal.normalized() + b.normal.normalized()).eval() : e.normal;
  Eigen::Matrix3d frame;
  frame.col(0) = (b.position - a.position).normalized();
  frame.col(1) = normal.cross(frame.col(0)).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace limber::beams
