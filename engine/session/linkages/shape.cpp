#include "engine/session/linkages/shape.h"

#include <Eigen/Geometry>

#include "engine/base/error.h"
#include "engine/rods/section/section_reach.h"

namespace limber::session {

LinkageShape::LinkageShape(const MappedLinkage& mapped, const scene::Linkage& linkage)
    : joints_(mapped.model.variables().joints()),
      outline_(rods::placed_outline(linkage.section, mapped.section, linkage.stiff_axis)) {
  const rods::ReducedVariables& variables = mapped.model.variables();
  for (int s = 0; s < variables.segments(); ++s) {
    edges_.push_back(variables.edges(s));
    joints_of_.push_back(mapped.model.graph().segments[static_cast<std::size_t>(s)].joints);
    size_ += 6 * edges_.back() + 3;
  }
  size_ += joints_;
  fill_triangles();
}

int LinkageShape::surface_nodes() const {
  int nodes = 0;
  for (const int edges : edges_) nodes += (edges + 1) * static_cast<int>(outline_.size());
  return nodes;
}

/// Caps are fans: right for convex sections, a little too much of the others'.
void LinkageShape::fill_triangles() {
  const int corners = static_cast<int>(outline_.size());
  int count = 0;
  for (const int edges : edges_) count += 2 * corners * edges + 2 * (corners - 2);
  triangles_.resize(3, count);
  int triangle = 0, first = 0;
  for (const int edges : edges_) {
    for (int i = 0; i < edges; ++i) {
      for (int c = 0; c < corners; ++c) {
        const int a = first + i * corners + c, b = first + i * corners + (c + 1) % corners;
        triangles_.col(triangle++) << a, b, b + corners;
        triangles_.col(triangle++) << a, b + corners, a + corners;
      }
    }
    const int last = first + edges * corners;
    for (int c = 1; c + 1 < corners; ++c) {
      triangles_.col(triangle++) << first, first + c + 1, first + c;
      triangles_.col(triangle++) << last, last + c, last + c + 1;
    }
    first = last + corners;
  }
  LIMBER_DEMAND(triangle == count);
}

Eigen::VectorXd LinkageShape::coordinates(const rods::LinkageModel& model,
                                          const rods::LinkageState& state) const {
  Eigen::VectorXd result(size_);
  Eigen::Index at = 0;
  for (int s = 0; s < static_cast<int>(edges_.size()); ++s) {
    const int edges = edges_[static_cast<std::size_t>(s)];
    for (int i = 0; i <= edges; ++i, at += 3) result.segment<3>(at) = state.vertex(model, s, i);
    for (int e = 0; e < edges; ++e, at += 3) result.segment<3>(at) = state.director(model, s, e);
  }
  for (const auto& joint : state.joints()) result[at++] = joint.opening_angle;
  return result;
}

Eigen::Matrix3Xd LinkageShape::joints(const Eigen::Ref<const Eigen::VectorXd>& coordinates) const {
  LIMBER_DEMAND(coordinates.size() == size_);
  Eigen::Matrix3Xd positions(3, joints_);
  Eigen::Index from = 0;
  for (std::size_t s = 0; s < edges_.size(); ++s) {
    for (const int end : {0, 1}) {
      const int joint = joints_of_[s][static_cast<std::size_t>(end)];
      if (joint < 0) continue;
      const Eigen::Index first = from + 3 * Eigen::Index{end == 0 ? 0 : edges_[s] - 1};
      positions.col(joint) =
          0.5 * (coordinates.segment<3>(first) + coordinates.segment<3>(first + 3));
    }
    from += 6 * Eigen::Index{edges_[s]} + 3;
  }
  return positions;
}

Eigen::VectorXd LinkageShape::surface(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                                      const Eigen::VectorXd& scales) const {
  LIMBER_DEMAND(coordinates.size() == size_);
  LIMBER_DEMAND(scales.size() == 0 || scales.size() == static_cast<Eigen::Index>(edges_.size()));
  Eigen::VectorXd result(3 * Eigen::Index{surface_nodes()});
  Eigen::Index from = 0, to = 0;
  for (std::size_t s = 0; s < edges_.size(); ++s) {
    const int edges = edges_[s];
    const double scale = scales.size() > 0 ? scales[static_cast<Eigen::Index>(s)] : 1;
    const auto vertex = [&](int i) -> Eigen::Vector3d {
      return coordinates.segment<3>(from + 3 * Eigen::Index{i});
    };
    const auto director = [&](int e) -> Eigen::Vector3d {
      return coordinates.segment<3>(from + 3 * Eigen::Index{edges + 1 + e});
    };
    for (int i = 0; i <= edges; ++i) {
      const int before = std::max(i - 1, 0), after = std::min(i, edges - 1);
      const Eigen::Vector3d tangent = ((vertex(before + 1) - vertex(before)).normalized() +
                                       (vertex(after + 1) - vertex(after)).normalized())
                                          .normalized();
      Eigen::Vector3d d1 = director(before) + director(after);
      d1 = (d1 - tangent * tangent.dot(d1)).normalized();
      const Eigen::Vector3d d2 = tangent.cross(d1);
      for (const Eigen::Vector2d& corner : outline_) {
        result.segment<3>(to) = vertex(i) + scale * corner.x() * d1 + scale * corner.y() * d2;
        to += 3;
      }
    }
    from += 6 * Eigen::Index{edges} + 3;
  }
  return result;
}

}  // namespace limber::session
