#include "engine/rods/equilibrium/floating_parts.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/rotations/shortest_rotation.h"
#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/holding.h"

namespace limber::rods {
namespace {

/// Share of the longest extent, squared: points that spread less from a line are on it.
constexpr double kLine = 1e-12;
/// Share of a motion: a smaller remainder after removal of the other motions is zero.
constexpr double kSamePosition = 1e-6;

/// From untouched parts to parts that do not move freely at all.
enum class Touch : char { kNothing, kLoads, kHeld };

/// By component.
std::vector<Touch> touches(const LinkageModel& model, const Conditions& from,
                           const Conditions& to) {
  const LinkageGraph& graph = model.graph();
  const std::vector<int> of_joints = detail::joint_components(graph);
  std::vector<Touch> result(static_cast<std::size_t>(graph.components), Touch::kNothing);
  const auto note = [&](int component, Touch touch) {
    Touch& known = result[static_cast<std::size_t>(component)];
    known = std::max(known, touch);
  };
  for (const JointPin& pin : to.pins)
    if (pin.hold != Hold::kAngle)
      note(of_joints[static_cast<std::size_t>(pin.joint)], Touch::kHeld);
  for (const Conditions* conditions : {&from, &to}) {
    const detail::ConditionTerms terms(model, *conditions);
    for (const detail::SpringPoint& spring : terms.springs()) {
      note(spring.joint >= 0 ? of_joints[static_cast<std::size_t>(spring.joint)]
                             : graph.segment_components[static_cast<std::size_t>(spring.segment)],
           Touch::kHeld);
    }
    const auto loads = terms.resultants();
    for (int c = 0; c < graph.components; ++c) {
      const auto& own = loads[static_cast<std::size_t>(c)];
      if (own.magnitudes > 0 || own.moment_magnitudes > 0) note(c, Touch::kLoads);
    }
  }
  return result;
}

Eigen::Matrix3Xd vertices_of(const LinkageModel& model, const LinkageState& state, int component) {
  std::vector<Eigen::Vector3d> points;
  for (int s = 0; s < model.variables().segments(); ++s) {
    if (model.graph().segment_components[static_cast<std::size_t>(s)] != component) continue;
    for (int i = 0; i <= model.variables().edges(s); ++i)
      points.push_back(state.vertex(model, s, i));
  }
  return Eigen::Map<const Eigen::Matrix3Xd>(points.front().data(), 3,
                                            static_cast<Eigen::Index>(points.size()));
}

/// The rotation that brings one set of points, about their means, nearest to another.
Eigen::Matrix3d best_rotation(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& target) {
  const Eigen::Matrix3Xd arms = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d products = (target.colwise() - target.rowwise().mean()) * arms.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d& u = svd.matrixU();
  const Eigen::Matrix3d& v = svd.matrixV();
  // Points on a line do not tell how they have turned about it.
  if (svd.singularValues()[1] <= kLine * svd.singularValues()[0])
    return rotations::shortest_rotation(v.col(0), u.col(0)).toRotationMatrix();
  const double side = (u * v.transpose()).determinant() < 0 ? -1 : 1;
  return u * Eigen::Vector3d(1, 1, side).asDiagonal() * v.transpose();
}

/// Increment of the vertices and joints of a part.
/// @param shift  of a place
template <class Shift>
Eigen::VectorXd shift_of_places(const LinkageModel& model, const LinkageState& state, int component,
                                const Shift& shift) {
  const ReducedVariables& variables = model.variables();
  const std::vector<int> of_joints = detail::joint_components(model.graph());
  Eigen::VectorXd increment = Eigen::VectorXd::Zero(variables.size());
  for (int j = 0; j < variables.joints(); ++j) {
    if (of_joints[static_cast<std::size_t>(j)] != component) continue;
    increment.segment<3>(variables.joint_begin(j) + kJointPosition) =
        shift(state.joints()[static_cast<std::size_t>(j)].position);
  }
  for (int s = 0; s < variables.segments(); ++s) {
    if (model.graph().segment_components[static_cast<std::size_t>(s)] != component) continue;
    for (int i = 0; i <= variables.edges(s); ++i) {
      const int position = variables.position(s, i);
      if (position >= 0) increment.segment<3>(position) = shift(state.vertex(model, s, i));
    }
  }
  return increment;
}

void turn_joints(const LinkageModel& model, int component, const Eigen::Vector3d& turn,
                 Eigen::VectorXd& increment) {
  const ReducedVariables& variables = model.variables();
  const std::vector<int> of_joints = detail::joint_components(model.graph());
  for (int j = 0; j < variables.joints(); ++j) {
    if (of_joints[static_cast<std::size_t>(j)] != component) continue;
    increment.segment<3>(variables.joint_begin(j) + kJointRotation) = turn;
  }
}

}  // namespace

void keep_in_place(const LinkageModel& model, const Conditions& from, const Conditions& to,
                   const LinkageState& before, LinkageState& state) {
  const std::vector<Touch> touched = touches(model, from, to);
  for (int c = 0; c < model.graph().components; ++c) {
    const Touch touch = touched[static_cast<std::size_t>(c)];
    if (touch == Touch::kHeld) continue;
    const Eigen::Matrix3Xd target = vertices_of(model, before, c);
    const Eigen::Matrix3Xd here = vertices_of(model, state, c);
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    if (touch == Touch::kNothing) motion.linear() = best_rotation(here, target);
    motion.translation() = target.rowwise().mean() - motion.linear() * here.rowwise().mean();
    state = state.moved_rigidly(model, c, motion);
  }
}

FreeMotions::FreeMotions(const LinkageModel& model, const Conditions& conditions,
                         const LinkageState& state) {
  if (conditions.springs.empty()) return;
  const std::vector<int> of_joints = detail::joint_components(model.graph());
  const detail::ConditionTerms terms(model, conditions);
  const auto loads = terms.resultants();
  for (int c = 0; c < model.graph().components; ++c) {
    const bool pinned =
        std::any_of(conditions.pins.begin(), conditions.pins.end(), [&](const JointPin& pin) {
          return pin.hold != Hold::kAngle && of_joints[static_cast<std::size_t>(pin.joint)] == c;
        });
    const auto& own = loads[static_cast<std::size_t>(c)];
    if (pinned || own.magnitudes > 0 || own.moment_magnitudes > 0) continue;
    const Eigen::Matrix3Xd points = vertices_of(model, state, c);
    const Eigen::Vector3d middle = points.rowwise().mean();
    const double size = (points.colwise() - middle).colwise().norm().maxCoeff();
    const detail::SpringHold springs(model, terms, state, c, middle, size);
    if (!springs.touches) continue;  // a joint is held instead
    const auto free = springs.unresisted();
    for (Eigen::Matrix<double, 6, 1> direction : free.colwise()) {
      direction.tail<3>() /= size;
      add(model, state, c, middle, direction);
    }
  }
}

/// Orthonormal by the motion of vertices and joints.
void FreeMotions::add(const LinkageModel& model, const LinkageState& state, int component,
                      const Eigen::Vector3d& about, const Eigen::Matrix<double, 6, 1>& direction) {
  const ReducedVariables& variables = model.variables();
  const Eigen::Vector3d turn = direction.tail<3>();
  Eigen::VectorXd places =
      shift_of_places(model, state, component, [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
        return direction.head<3>() + turn.cross(x - about);
      });
  Eigen::VectorXd motion = places;
  turn_joints(model, component, turn, motion);
  for (int s = 0; s < variables.segments(); ++s) {
    if (model.graph().segment_components[static_cast<std::size_t>(s)] != component) continue;
    for (int e = 0; e < variables.edges(s); ++e) {
      const Eigen::Vector3d edge = state.vertex(model, s, e + 1) - state.vertex(model, s, e);
      if (variables.angle(s, e) >= 0) motion[variables.angle(s, e)] = turn.dot(edge.normalized());
    }
  }
  const double size = places.norm();
  for (std::size_t k = 0; k < motions_.size(); ++k) {
    const double share = places_[k].dot(places);
    motion -= share * motions_[k];
    places -= share * places_[k];
  }
  if (!(places.norm() > kSamePosition * size)) return;
  motions_.push_back(motion / places.norm());
  places_.push_back(places / places.norm());
}

void FreeMotions::remove_from(Eigen::VectorXd& motion) const {
  if (motion.size() == 0) return;
  for (std::size_t k = 0; k < motions_.size(); ++k) motion -= places_[k].dot(motion) * motions_[k];
}

}  // namespace limber::rods
