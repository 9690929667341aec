#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/mapping.h"

namespace limber::session {

/// Shapes of a linkage as the numbers that are streamed, and as surfaces.
///
/// Coordinates of one shape, float32, lengths in the scene's unit. For each segment in order: its
/// vertices x_0 .. x_n (x, y, z each), then the directors d_1 of its edges 0 .. n-1. After all
/// segments: the opening angle of each joint [rad]. The first and the last edge of a segment reach
/// half their length beyond its joints.
///
/// The surface is the section swept along each segment: m points around each vertex, on d_1 and
/// d_2 = t x d_1 of the mean of its edges' frames.
class LinkageShape {
 public:
  LinkageShape(const MappedLinkage& mapped, const scene::Linkage& linkage);

  [[nodiscard]] int size() const { return size_; }  // coordinates
  [[nodiscard]] int joint_count() const { return joints_; }
  [[nodiscard]] int surface_nodes() const;
  /// Triangles, 3 x count, outward; sides and end caps.
  [[nodiscard]] const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles() const {
    return triangles_;
  }
  /// The section's outline around the rod's axis, in (d_1, d_2) [scene length unit].
  [[nodiscard]] const std::vector<Eigen::Vector2d>& outline() const { return outline_; }

  [[nodiscard]] Eigen::VectorXd coordinates(const rods::LinkageModel& model,
                                            const rods::LinkageState& state) const;
  /// Positions of joints: middles of the edges that end there. @param coordinates  of one shape
  [[nodiscard]] Eigen::Matrix3Xd joints(const Eigen::Ref<const Eigen::VectorXd>& coordinates) const;
  /// @param coordinates  of one shape
  /// @param scales  of each segment's section, by which its outline is scaled; empty: all 1
  /// @returns 3 surface_nodes()
  [[nodiscard]] Eigen::VectorXd surface(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                                        const Eigen::VectorXd& scales = {}) const;

 private:
  void fill_triangles();

  std::vector<int> edges_;                     // of each segment
  std::vector<std::array<int, 2>> joints_of_;  // of each segment; -1: a free end
  int joints_ = 0, size_ = 0;
  std::vector<Eigen::Vector2d> outline_;
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles_;
};

}  // namespace limber::session
