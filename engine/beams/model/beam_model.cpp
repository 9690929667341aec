#include "engine/beams/model/beam_model.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <unordered_map>

namespace limber::beams {

namespace {

constexpr double kSameAxes = 1e-8;
/// Sine of 0.1 degrees: closer to an element, a normal says nothing about its section.
constexpr double kAlongElement = 1.7453e-3;

/// Which of the axes that the rows of a rotation stand for lie in the span of the given ones;
/// nothing where one lies neither in it nor across it.
std::optional<std::array<bool, 3>> spanned(const Eigen::Matrix3d& turn,
                                           const std::array<bool, 3>& given) {
  std::array<bool, 3> result{};
  for (int i = 0; i < 3; ++i) {
    double within = 0, across = 0;
    for (int k = 0; k < 3; ++k)
      (given[static_cast<std::size_t>(k)] ? within : across) += turn(i, k) * turn(i, k);
    if (std::min(within, across) > kSameAxes * kSameAxes) return {};
    result[static_cast<std::size_t>(i)] = within > across;
  }
  return result;
}

Eigen::Vector3d masked(const Eigen::Vector3d& components, const std::array<bool, 3>& given) {
  return {given[0] ? components.x() : 0, given[1] ? components.y() : 0,
          given[2] ? components.z() : 0};
}

}  // namespace

std::optional<PrescribedMotion> by_axes(const PrescribedMotion& motion,
                                        const Eigen::Matrix3d& axes) {
  const Eigen::Matrix3d turn = axes.transpose() * motion.axes;
  const auto translates = spanned(turn, motion.translates);
  const auto rotates = spanned(turn, motion.rotates);
  if (!translates || !rotates) return {};
  PrescribedMotion result = motion;
  result.axes = axes;
  result.translates = *translates;
  result.rotates = *rotates;
  result.translation = turn * masked(motion.translation, motion.translates);
  result.rotation = turn * masked(motion.rotation, motion.rotates);
  return result;
}

void give_motions_precedence(BeamModel& model) {
  // The first one of each node: validate() refuses others.
  std::unordered_map<int, BeamSupport*> support_of;
  for (BeamSupport& support : model.supports) support_of.emplace(support.node, &support);
  for (const PrescribedMotion& motion : model.motions) {
    const auto found = support_of.find(motion.node);
    if (found == support_of.end()) continue;
    BeamSupport& support = *found->second;
    const auto moved = by_axes(motion, support.axes);
    for (std::size_t k = 0; moved && k < 3; ++k) {
      support.fixed[k] = support.fixed[k] && !moved->translates[k];
      support.fixed[3 + k] = support.fixed[3 + k] && !moved->rotates[k];
    }
  }
}

std::vector<char> used_nodes(const BeamModel& model) {
  std::vector<char> used(model.nodes.size(), model.elements.empty() ? 1 : 0);
  for (const BeamElement& e : model.elements)
    used[static_cast<std::size_t>(e.start)] = used[static_cast<std::size_t>(e.finish)] = 1;
  return used;
}

std::string element_name(const BeamModel& model, int element) {
  if (model.element_parts.empty()) return fmt::format("element {}", element);
  const ElementPart& part = model.element_parts[static_cast<std::size_t>(element)];
  if (part.parts == 1) return fmt::format("element {}", part.element);
  return fmt::format("element {}, part {} of {}", part.element, part.part + 1, part.parts);
}

std::string node_name(const BeamModel& model, int node) {
  for (std::size_t e = 0; e < model.element_parts.size(); ++e) {
    const ElementPart& part = model.element_parts[e];
    if (model.elements[e].finish == node && part.part + 1 < part.parts)
      return fmt::format("a point inside of element {}", part.element);
  }
  return fmt::format("node {}", node);
}

double drawn_length(const BeamModel& model, int element) {
  const BeamElement& e = model.elements[static_cast<std::size_t>(element)];
  return (model.nodes[static_cast<std::size_t>(e.finish)].position -
          model.nodes[static_cast<std::size_t>(e.start)].position)
      .norm();
}

Eigen::Vector3d drawn_normal(const BeamModel& model, int element) {
  const BeamElement& e = model.elements[static_cast<std::size_t>(element)];
  if (!e.normal.isZero(0)) return e.normal;
  const BeamNode& a = model.nodes[static_cast<std::size_t>(e.start)];
  const BeamNode& b = model.nodes[static_cast<std::size_t>(e.finish)];
  const Eigen::Vector3d along = (b.position - a.position).normalized();
  const auto is_usable = [&](const Eigen::Vector3d& normal) {
    return normal.cross(along).norm() > kAlongElement * std::max(normal.norm(), kAlongElement);
  };
  const Eigen::Vector3d mean = a.normal.normalized() + b.normal.normalized();
  if (is_usable(mean)) return mean;
  if (is_usable(Eigen::Vector3d::UnitZ())) return Eigen::Vector3d::UnitZ();
  return Eigen::Vector3d::UnitX();
}

Eigen::Matrix3d drawn_frame(const BeamModel& model, int element) {
  const BeamElement& e = model.elements[static_cast<std::size_t>(element)];
  Eigen::Matrix3d frame;
  frame.col(0) = (model.nodes[static_cast<std::size_t>(e.finish)].position -
                  model.nodes[static_cast<std::size_t>(e.start)].position)
                     .normalized();
  frame.col(1) = drawn_normal(model, element).cross(frame.col(0)).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace limber::beams
