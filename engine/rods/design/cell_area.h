#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/design/shape_function.h"
#include "engine/rods/linkage/linkage_model.h"

namespace limber::rods {

/// Area of the cells between a linkage's rods [length^2]: how much of a surface it covers that its
/// joints are near to.
///
/// A cell of joints x_1 .. x_n around (linkage_cells) is a fan about their mean m, one of three
/// joints the triangle between them:
///
///   A = sum over cells of sum over k of 1/2 |(x_k - m) x (x_k+1 - m)|.
///
/// Joints count where they are, not where their closest points on the surface are. That keeps A
/// smooth, and differs by a share of about their distance times the surface's curvature; joints
/// that hang over the rim count in full.
class CellArea final : public ShapeFunction {
 public:
  /// @pre the model outlives this
  explicit CellArea(const LinkageModel& model);

  [[nodiscard]] bool has_cells() const { return !triangles_.empty(); }

  [[nodiscard]] double value(const LinkageState& state) override;
  void add_gradient(const LinkageState& state, double weight,
                    Eigen::Ref<Eigen::VectorXd> by) override;
  void add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                  double weight, Eigen::Ref<Eigen::VectorXd> by) override;

 private:
  /// Corners are joints, or means of cells, which come after all joints.
  using Corners = Eigen::Matrix3Xd;
  [[nodiscard]] Corners corners_of(const LinkageState& state) const;
  [[nodiscard]] Corners with_means(Corners of_joints) const;
  /// Hands numbers of means on to their joints.
  void add_to_joints(const Corners& of_corners, Eigen::Ref<Eigen::VectorXd> by) const;

  const LinkageModel& model_;
  std::vector<std::vector<int>> fans_;  // joints around each cell of more than three
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace limber::rods
