#include "engine/rods/design/cell_area.h"

#include <Eigen/Geometry>
#include <limits>

#include "engine/rods/design/linkage_cells.h"

namespace limber::rods {
namespace {

/// Two sides of a triangle from its first corner, and the normal to both.
struct Triangle {
  Triangle(const Eigen::Matrix3Xd& at, const Eigen::Vector3i& corners)
      : first(at.col(corners[1]) - at.col(corners[0])),
        second(at.col(corners[2]) - at.col(corners[0])),
        twice(first.cross(second).norm()) {
    // Folded to a line it has no normal: there the area has a least value, and no derivative.
    if (twice > std::numeric_limits<double>::epsilon() * first.norm() * second.norm())
      normal = first.cross(second) / twice;
  }
  Eigen::Vector3d first, second, normal = Eigen::Vector3d::Zero();
  double twice;  // the area
};

void add(const Eigen::Vector3i& corners, const Eigen::Vector3d& by_first,
         const Eigen::Vector3d& by_second, Eigen::Matrix3Xd& sum) {
  sum.col(corners[0]) -= by_first + by_second;
  sum.col(corners[1]) += by_first;
  sum.col(corners[2]) += by_second;
}

}  // namespace

CellArea::CellArea(const LinkageModel& model) : model_(model) {
  int middle = model.variables().joints();
  for (const std::vector<int>& cell : linkage_cells(model.graph())) {
    if (cell.size() == 3) {
      triangles_.emplace_back(cell[0], cell[1], cell[2]);
      continue;
    }
    for (std::size_t k = 0; k < cell.size(); ++k)
      triangles_.emplace_back(middle, cell[k], cell[(k + 1) % cell.size()]);
    fans_.push_back(cell);
    ++middle;
  }
}

CellArea::Corners CellArea::with_means(Corners of_joints) const {
  const Eigen::Index joints = of_joints.cols();
  of_joints.conservativeResize(3, joints + static_cast<Eigen::Index>(fans_.size()));
  for (std::size_t f = 0; f < fans_.size(); ++f) {
    const Eigen::Index at = joints + static_cast<Eigen::Index>(f);
    of_joints.col(at).setZero();
    for (const int joint : fans_[f])
      of_joints.col(at) += of_joints.col(joint) / static_cast<double>(fans_[f].size());
  }
  return of_joints;
}

CellArea::Corners CellArea::corners_of(const LinkageState& state) const {
  Corners positions(3, model_.variables().joints());
  for (Eigen::Index j = 0; j < positions.cols(); ++j)
    positions.col(j) = state.joints()[static_cast<std::size_t>(j)].position;
  return with_means(std::move(positions));
}

void CellArea::add_to_joints(const Corners& of_corners, Eigen::Ref<Eigen::VectorXd> by) const {
  const int joints = model_.variables().joints();
  const auto add_at = [&](int joint, const Eigen::Vector3d& value) {
    by.segment<3>(model_.variables().joint_begin(joint) + kJointPosition) += value;
  };
  for (int j = 0; j < joints; ++j) add_at(j, of_corners.col(j));
  for (std::size_t f = 0; f < fans_.size(); ++f)
    for (const int joint : fans_[f])
      add_at(joint, of_corners.col(joints + static_cast<Eigen::Index>(f)) /
                        static_cast<double>(fans_[f].size()));
}

double CellArea::value(const LinkageState& state) {
  const Corners at = corners_of(state);
  double sum = 0;
  for (const Eigen::Vector3i& corners : triangles_) sum += 0.5 * Triangle(at, corners).twice;
  return sum;
}

void CellArea::add_gradient(const LinkageState& state, double weight,
                            Eigen::Ref<Eigen::VectorXd> by) {
  const Corners at = corners_of(state);
  Corners sum = Corners::Zero(3, at.cols());
  for (const Eigen::Vector3i& corners : triangles_) {
    const Triangle t(at, corners);
    add(corners, 0.5 * weight * t.second.cross(t.normal), 0.5 * weight * t.normal.cross(t.first),
        sum);
  }
  add_to_joints(sum, by);
}

void CellArea::add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                          double weight, Eigen::Ref<Eigen::VectorXd> by) {
  const Corners at = corners_of(state);
  Corners moves(3, model_.variables().joints());
  for (int j = 0; j < moves.cols(); ++j)
    moves.col(j) = v.segment<3>(model_.variables().joint_begin(j) + kJointPosition);
  moves = with_means(std::move(moves));
  Corners sum = Corners::Zero(3, at.cols());
  for (const Eigen::Vector3i& corners : triangles_) {
    const Triangle t(at, corners);
    if (t.normal.isZero(0)) continue;
    const Eigen::Vector3d first = moves.col(corners[1]) - moves.col(corners[0]);
    const Eigen::Vector3d second = moves.col(corners[2]) - moves.col(corners[0]);
    const Eigen::Vector3d change = first.cross(t.second) + t.first.cross(second);
    const Eigen::Vector3d turn = (change - t.normal.dot(change) * t.normal) / t.twice;
    add(corners, 0.5 * weight * (second.cross(t.normal) + t.second.cross(turn)),
        0.5 * weight * (turn.cross(t.first) + t.normal.cross(first)), sum);
  }
  add_to_joints(sum, by);
}

}  // namespace limber::rods
