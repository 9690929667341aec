#include "engine/rods/rod/source_frames.h"

#include <fmt/core.h>

#include <Eigen/Geometry>

#include "engine/base/error.h"
#include "engine/base/rotations/angles.h"
#include "engine/base/rotations/parallel_transport.h"

namespace limber::rods {

namespace {

Eigen::Vector3d tangent_of(const Eigen::Ref<const Eigen::VectorXd>& unknowns, int rod, int edge,
                           int slot) {
  const Eigen::Vector3d e = unknowns.segment<3>(4 * (slot + 1)) - unknowns.segment<3>(4 * slot);
  const double length = e.norm();
  if (!(length > 0) || !std::isfinite(length)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("rods[{}].edges[{}]", rod, edge),
                fmt::format("an edge must have a positive length, got {}", length));
  }
  return e / length;
}

Eigen::Vector3d orthogonal_unit(const Eigen::Vector3d& director, const Eigen::Vector3d& tangent,
                                int rod, int edge) {
  const Eigen::Vector3d across = director - tangent.dot(director) * tangent;
  const double length = across.norm();
  if (!(length > 1e-8 * director.norm())) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("rods[{}].edges[{}].director", rod, edge),
                "a director must not be along its edge");
  }
  return across / length;
}

void demand_unfolded(const Eigen::Vector3d& before, const Eigen::Vector3d& after, int rod,
                     int vertex) {
  if (!rotations::are_opposite(before, after)) return;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("rods[{}].vertices[{}]", rod, vertex),
              "the edges at a vertex fold back onto each other: their curvature is not finite");
}

}  // namespace

SourceFrames SourceFrames::without_twist(
    const RodLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& unknowns,
    const Eigen::Ref<const Eigen::Matrix3Xd>& first_directors) {
  LIMBER_DEMAND(unknowns.size() == layout.unknowns() && first_directors.cols() == layout.rods());
  SlotArray values = SlotArray::Zero(layout.rows(), kFields);
  for (int r = 0; r < layout.rods(); ++r) {
    Eigen::Vector3d director = first_directors.col(r), previous = Eigen::Vector3d::Zero();
    for (int i = 0; i < layout.edges(r); ++i) {
      const int slot = layout.first_node(r) + i;
      const Eigen::Vector3d tangent = tangent_of(unknowns, r, i, slot);
      if (i == 0) {
        if (director.isZero(0)) director = tangent.unitOrthogonal();
      } else {
        demand_unfolded(previous, tangent, r, i);
        director = rotations::parallel_transport(previous, tangent, director);
      }
      director = orthogonal_unit(director, tangent, r, i);
      values.row(slot).segment<3>(kTangent) = tangent;
      values.row(slot).segment<3>(kDirector) = director;
      previous = tangent;
    }
  }
  return SourceFrames(std::move(values));
}

SourceFrames SourceFrames::from_directors(const RodLayout& layout,
                                          const Eigen::Ref<const Eigen::VectorXd>& unknowns,
                                          const Eigen::Ref<const Eigen::Matrix3Xd>& directors) {
  LIMBER_DEMAND(unknowns.size() == layout.unknowns() && directors.cols() >= layout.nodes());
  SlotArray values = SlotArray::Zero(layout.rows(), kFields);
  for (int r = 0; r < layout.rods(); ++r) {
    Eigen::Vector3d previous_director = Eigen::Vector3d::Zero(), previous = previous_director;
    for (int i = 0; i < layout.edges(r); ++i) {
      const int slot = layout.first_node(r) + i;
      const Eigen::Vector3d tangent = tangent_of(unknowns, r, i, slot);
      const Eigen::Vector3d director = orthogonal_unit(directors.col(slot), tangent, r, i);
      values.row(slot).segment<3>(kTangent) = tangent;
      values.row(slot).segment<3>(kDirector) = director;
      if (i > 0) {
        demand_unfolded(previous, tangent, r, i);
        const Eigen::Vector3d moved =
            rotations::parallel_transport(previous, tangent, previous_director);
        values(slot, kTwist) =
            rotations::angle_of(moved.dot(director), tangent.dot(moved.cross(director)));
      }
      previous = tangent;
      previous_director = director;
    }
  }
  return SourceFrames(std::move(values));
}

}  // namespace limber::rods
