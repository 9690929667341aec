#include "engine/rods/equilibrium/condition_terms.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace limber::rods::detail {
namespace {

SpringPoint point_of(const TargetSpring& spring, const ReducedVariables& variables) {
  SpringPoint point;
  point.target = spring.position;
  point.stiffness = spring.stiffness;
  if (const auto* joint = std::get_if<JointPoint>(&spring.at)) {
    point.joint = joint->joint;
  } else if (const auto* vertex = std::get_if<VertexPoint>(&spring.at)) {
    point.segment = vertex->segment;
    point.edge = std::min(vertex->vertex, variables.edges(vertex->segment) - 1);
    point.share = vertex->vertex - point.edge;
  } else if (const auto* arc = std::get_if<ArcPoint>(&spring.at)) {
    const int edges = variables.edges(arc->segment);
    point.segment = arc->segment;
    point.edge = std::min(static_cast<int>(arc->share * edges), edges - 1);
    point.share = arc->share * edges - point.edge;
  }
  return point;
}

void add_stiffness(const SpringPoint& spring, CondensedMatrix& hessian) {
  const double t = spring.share;
  for (int axis = 0; axis < 3; ++axis) {
    if (spring.joint >= 0) {
      hessian.joint(spring.joint)[std::ptrdiff_t{axis} * (kJointUnknowns + 1)] += spring.stiffness;
      continue;
    }
    const int low = 4 * spring.edge + axis;
    hessian.entry(spring.segment, low, low) += spring.stiffness * (1 - t) * (1 - t);
    hessian.entry(spring.segment, low + 4, low) += spring.stiffness * t * (1 - t);
    hessian.entry(spring.segment, low + 4, low + 4) += spring.stiffness * t * t;
  }
}

}  // namespace

ConditionTerms::ConditionTerms(const LinkageModel& model, const Conditions& conditions)
    : model_(model),
      loads_(Eigen::VectorXd::Zero(model.variables().size())),
      moments_(Eigen::VectorXd::Zero(model.variables().size())),
      ends_(2 * static_cast<std::size_t>(model.variables().segments())),
      touched_(ends_.size(), 0) {
  for (const TargetSpring& spring : conditions.springs)
    springs_.push_back(point_of(spring, model.variables()));
  for (const JointLoad& load : conditions.loads) {
    const int begin = model.variables().joint_begin(load.joint);
    loads_.segment<3>(begin + kJointPosition) += load.force;
    loads_[begin + kJointAngle] += load.opening_torque;
    moments_.segment<3>(begin + kJointRotation) += load.moment;
    largest_load_ = std::max(largest_load_, load.force.norm());
    largest_moment_ =
        std::max({largest_moment_, load.moment.norm(), std::abs(load.opening_torque)});
  }
  weigh(conditions.gravity);
}

/// Half of every edge weighs on each of its vertices.
void ConditionTerms::weigh(const Gravity& gravity) {
  weight_ = gravity.mass_per_length * gravity.acceleration;
  if (weight_.isZero(0)) return;
  const ReducedVariables& variables = model_.variables();
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    const std::array<int, 2>& joints = model_.graph().segments[s].joints;
    const auto first = static_cast<int>(vertex_lengths_.size());
    first_vertex_.push_back(first);
    vertex_lengths_.resize(vertex_lengths_.size() + static_cast<std::size_t>(edges) + 1, 0.0);
    for (int e = 0; e < edges; ++e) {
      const bool terminal =
          (e == 0 && joints[kStart] >= 0) || (e == edges - 1 && joints[kFinish] >= 0);
      const double carried = 0.5 * (terminal ? kTerminalDensity : 1.0) *
                             std::pow(model_.section_scales()[s], 2) *
                             model_.rest_lengths().edge(model_.graph(), variables, s, e);
      vertex_lengths_[first + e] += carried;
      vertex_lengths_[first + e + 1] += carried;
    }
  }
  for (const double length : vertex_lengths_)
    largest_load_ = std::max(largest_load_, length * weight_.norm());
}

Eigen::Vector3d ConditionTerms::place(const LinkageState& state, const SpringPoint& spring) const {
  if (spring.joint >= 0) return state.joints()[spring.joint].position;
  return (1 - spring.share) * state.vertex(model_, spring.segment, spring.edge) +
         spring.share * state.vertex(model_, spring.segment, spring.edge + 1);
}

ConditionTerms::Potential ConditionTerms::potential(const LinkageState& state) const {
  Potential result;
  for (const SpringPoint& spring : springs_) {
    result.springs += 0.5 * spring.stiffness * (place(state, spring) - spring.target).squaredNorm();
  }
  result.size = result.springs;
  const auto add = [&](double work) {
    result.loads -= work;
    result.size += std::abs(work);
  };
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const int begin = model_.variables().joint_begin(j);
    add(loads_.segment<3>(begin).dot(state.joints()[j].position));
    add(loads_[begin + kJointAngle] * state.joints()[j].opening_angle);
  }
  for (std::size_t s = 0; s < first_vertex_.size(); ++s) {
    const int segment = static_cast<int>(s);
    for (int i = 0; i <= model_.variables().edges(segment); ++i)
      add(vertex_lengths_[first_vertex_[s] + i] * weight_.dot(state.vertex(model_, segment, i)));
  }
  return result;
}

/// Adds a derivative by a vertex, no matter which unknowns move it.
void ConditionTerms::add_to_vertex(int segment, int vertex, const Eigen::Vector3d& value,
                                   Eigen::Ref<Eigen::VectorXd> gradient) {
  const int unknown = model_.variables().position(segment, vertex);
  if (unknown >= 0) {
    gradient.segment<3>(unknown) += value;
    return;
  }
  const int edges = model_.variables().edges(segment);
  const bool at_start = vertex <= 1 && model_.graph().segments[segment].joints[kStart] >= 0;
  const int end = 2 * segment + (at_start ? kStart : kFinish);
  if (touched_[end] == 0) ends_[end].setZero();
  touched_[end] = 1;
  const int first = at_start ? 0 : edges - 1;
  ends_[end].segment<3>(vertex == first ? 0 : 4) += value;
}

void ConditionTerms::add_both(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                              CondensedMatrix* hessian) {
  gradient -= loads_;
  gradient -= moments_;
  std::fill(touched_.begin(), touched_.end(), 0);
  for (std::size_t s = 0; s < first_vertex_.size(); ++s) {
    const int segment = static_cast<int>(s);
    for (int i = 0; i <= model_.variables().edges(segment); ++i)
      add_to_vertex(segment, i, -vertex_lengths_[first_vertex_[s] + i] * weight_, gradient);
  }
  for (const SpringPoint& spring : springs_) {
    const Eigen::Vector3d pull = -this->pull(state, spring);
    if (spring.joint >= 0) {
      gradient.segment<3>(model_.variables().joint_begin(spring.joint)) += pull;
    } else {
      add_to_vertex(spring.segment, spring.edge, (1 - spring.share) * pull, gradient);
      add_to_vertex(spring.segment, spring.edge + 1, spring.share * pull, gradient);
    }
    if (hessian != nullptr) add_stiffness(spring, *hessian);
  }
  add_ends(state, gradient, hessian);
}

/// From terminal edges to their joints: J^T g, and g times the curvature of the edge.
void ConditionTerms::add_ends(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                              CondensedMatrix* hessian) {
  using Block = Eigen::Matrix<double, kJointUnknowns, kJointUnknowns>;
  for (std::size_t index = 0; index < ends_.size(); ++index) {
    if (touched_[index] == 0) continue;
    const Segment& segment = model_.graph().segments[index / 2];
    const auto end = index % 2;
    const int joint = segment.joints[end];
    const auto source =
        terminal_edge_source(state.joints()[joint], segment.rods[end], segment.signs[end]);
    gradient.segment<kJointUnknowns>(model_.variables().joint_begin(joint)) +=
        terminal_gradient(source, ends_[index]);
    if (hessian == nullptr) continue;
    Eigen::Map<Block>(hessian->joint(joint)) += terminal_curvature(source, ends_[index]);
  }
}

Eigen::Matrix<double, kJointUnknowns, 1> ConditionTerms::end_gradient(const LinkageState& state,
                                                                      int segment, End end) const {
  const std::size_t index = 2 * static_cast<std::size_t>(segment) + end;
  if (touched_[index] == 0) return Eigen::Matrix<double, kJointUnknowns, 1>::Zero();
  const Segment& of = model_.graph().segments[static_cast<std::size_t>(segment)];
  const auto& joint = state.joints()[static_cast<std::size_t>(of.joints[end])];
  return terminal_gradient(terminal_edge_source(joint, of.rods[end], of.signs[end]), ends_[index]);
}

Eigen::Vector3d ConditionTerms::weight(int segment) const {
  if (first_vertex_.empty()) return Eigen::Vector3d::Zero();
  const auto first = vertex_lengths_.begin() + first_vertex_[static_cast<std::size_t>(segment)];
  const int vertices = model_.variables().edges(segment) + 1;
  return std::accumulate(first, first + vertices, 0.0) * weight_;
}

std::vector<ConditionTerms::Resultant> ConditionTerms::resultants() const {
  const LinkageGraph& graph = model_.graph();
  std::vector<Resultant> result(static_cast<std::size_t>(graph.components));
  const auto add = [&](int component, const Eigen::Vector3d& force) {
    result[component].force += force;
    result[component].magnitudes += force.norm();
  };
  for (std::size_t j = 0; j < graph.joints.size(); ++j) {
    int segment = -1;
    for (const auto& rod : graph.joints[j].segments) segment = std::max({segment, rod[0], rod[1]});
    const int begin = model_.variables().joint_begin(static_cast<int>(j));
    const int component = graph.segment_components[segment];
    add(component, loads_.segment<3>(begin));
    const Eigen::Vector3d moment = moments_.segment<3>(begin + kJointRotation);
    result[component].moment += moment;
    result[component].moment_magnitudes += moment.norm();
  }
  for (std::size_t s = 0; s < first_vertex_.size(); ++s) {
    for (int i = 0; i <= model_.variables().edges(static_cast<int>(s)); ++i)
      add(graph.segment_components[s], vertex_lengths_[first_vertex_[s] + i] * weight_);
  }
  return result;
}

double ConditionTerms::largest_force(const LinkageState& state) const {
  double largest = largest_load_;
  for (const SpringPoint& spring : springs_) {
    largest = std::max(largest, pull(state, spring).norm());
  }
  return largest;
}

}  // namespace limber::rods::detail
