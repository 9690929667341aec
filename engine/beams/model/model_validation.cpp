#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "engine/base/disjoint_sets.h"
#include "engine/base/error.h"
#include "engine/beams/model/beam_model.h"
#include "engine/beams/model/loose_spins.h"

namespace limber::beams {

namespace {

/// Squares of larger numbers overflow.
constexpr double kLargest = 1e100;
/// Multiple of the shortest element: farther from the origin, rounding of coordinates shows as
/// strain.
constexpr double kFarthest = 1e6;
/// Attitudes of ends that are twisted further come close to half a turn [rad].
constexpr double kMaxRestTwistRad = 2;
/// Share of a moment for its part that acts where nothing takes it.
constexpr double kRounding = 1e-9;

/// A field. Becomes text where something is wrong with it alone: writing the names of all that is
/// sound would take most of the time.
struct Field {
  const char* list;
  std::size_t index;
  const char *between, *rest;

  operator std::string() const {  // NOLINT(google-explicit-constructor): stands for its name
    return fmt::format("{}[{}]{}{}", list, index, between, rest);
  }
};
Field at(const char* list, std::size_t index, const char* member = "") {
  return {list, index, *member == 0 ? "" : ".", member};
}
/// Describes in words a field for which clients give no name.
Field described(const char* list, std::size_t index, const char* words) {
  return {list, index, ": ", words};
}
[[noreturn]] void refuse(const std::string& field, const std::string& why,
                         ErrorCode code = ErrorCode::kInvalidArgument) {
  // "sections[3]: its stiffness E A" is a number that a structure derives from others: the field is
  // its owner.
  throw Error(code, field.substr(0, field.find(':')), fmt::format("{} {}", field, why));
}
void require_index(int index, std::size_t count, const Field& field, const char* what) {
  if (index < 0 || static_cast<std::size_t>(index) >= count)
    refuse(field, fmt::format("= {}, but there are {} {}", index, count, what),
           ErrorCode::kOutOfRange);
}
template <class Name>
void require_finite(const Eigen::Vector3d& value, const Name& field) {
  if (!(value.cwiseAbs().maxCoeff() <= kLargest) || !value.allFinite())
    refuse(field, fmt::format("= ({}, {}, {}), must be finite, and at most {:g}", value.x(),
                              value.y(), value.z(), kLargest));
}
void require_positive(double value, const Field& field) {
  if (!(value > 0) || !(value <= kLargest))
    refuse(field, fmt::format("= {}, must be > 0, and at most {:g}", value, kLargest));
}
void require_not_negative(double value, const Field& field) {
  if (!(value >= 0) || !(value <= kLargest))
    refuse(field, fmt::format("= {}, must be >= 0, and at most {:g}", value, kLargest));
}

void check_nodes(const BeamModel& model) {
  if (model.nodes.empty()) refuse("nodes", "is empty", ErrorCode::kFailedPrecondition);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    require_finite(model.nodes[i].position, at("nodes", i, "position"));
    require_finite(model.nodes[i].normal, at("nodes", i, "normal"));
    if (model.nodes[i].normal.isZero(0)) refuse(at("nodes", i, "normal"), "is zero");
  }
}

void check_sections(const BeamModel& model) {
  std::vector<char> bends(model.sections.size(), 0);
  for (const BeamElement& e : model.elements) {
    if (e.kind == BeamKind::kBeam && e.section >= 0 &&
        static_cast<std::size_t>(e.section) < bends.size())
      bends[static_cast<std::size_t>(e.section)] = 1;
  }
  for (std::size_t i = 0; i < model.sections.size(); ++i) {
    const BeamSection& s = model.sections[i];
    require_positive(s.stretching, described("sections", i, "its stiffness E A"));
    for (const auto& [value, name] : {std::pair{s.torsion, "its stiffness G J"},
                                      {s.bending_2, "its stiffness E I about axis 2"},
                                      {s.bending_3, "its stiffness E I about axis 3"}}) {
      if (bends[i] != 0)
        require_positive(value, described("sections", i, name));
      else
        require_not_negative(value, described("sections", i, name));
    }
    for (const auto& [value, name] : {std::pair{s.mass_per_length, "its mass per length"},
                                      {s.shear, "its shear modulus"},
                                      {s.fibre_2, "half its width"},
                                      {s.fibre_3, "half its height"},
                                      {s.shear_arm, "its largest shear strain"}})
      require_not_negative(value, described("sections", i, name));
    require_not_negative(s.young, at("sections", i, "young"));
    require_not_negative(s.yield_stress, at("sections", i, "yield_stress"));
  }
}

/// An end that releases everything holds nothing; both ends releasing the same force or
/// twist leave a part of the element loose.
void check_releases(const BeamElement& e, std::size_t i) {
  if (e.kind == BeamKind::kCable) {
    if (!(e.start_release == EndRelease{}) || !(e.finish_release == EndRelease{}))
      refuse(at("elements", i), "is a cable, which has no moments to release");
    if (!e.rest_curvature.isZero(0)) refuse(at("elements", i, "rest_curvature"), "of a cable");
    return;
  }
  if (e.start_release.rotations[0] && e.finish_release.rotations[0])
    refuse(at("elements", i, "finish_release"),
           "releases twist, as start_release does: the element would turn about itself");
  for (std::size_t k = 0; k < 3; ++k) {
    if (e.start_release.forces[k] && e.finish_release.forces[k])
      refuse(at("elements", i, "finish_release"),
             fmt::format("releases force {}, as start_release does: once is enough", k + 1));
  }
}

void check_elements(const BeamModel& model) {
  std::map<std::pair<int, int>, std::size_t> edge_elements;
  for (std::size_t i = 0; i < model.elements.size(); ++i) {
    const BeamElement& e = model.elements[i];
    require_index(e.start, model.nodes.size(), at("elements", i, "start"), "nodes");
    require_index(e.finish, model.nodes.size(), at("elements", i, "finish"), "nodes");
    require_index(e.section, model.sections.size(), at("elements", i, "section"), "sections");
    require_finite(e.normal, at("elements", i, "normal"));
    require_finite(e.rest_curvature, at("elements", i, "rest_curvature"));
    require_not_negative(e.rest_length, at("elements", i, "rest_length"));
    const Eigen::Vector3d& p = model.nodes[static_cast<std::size_t>(e.start)].position;
    const Eigen::Vector3d& q = model.nodes[static_cast<std::size_t>(e.finish)].position;
    // Below this, the direction of the element is rounding of the coordinates.
    const double farthest = std::max(p.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff());
    if (e.start == e.finish || !((q - p).norm() > 1e-12 * farthest))
      refuse(at("elements", i), fmt::format("has zero length: nodes {} and {}", e.start, e.finish));
    const auto [other, fresh] = edge_elements.emplace(std::minmax(e.start, e.finish), i);
    if (!fresh)
      refuse(at("elements", i), fmt::format("joins nodes {} and {}, as elements[{}] does", e.start,
                                            e.finish, other->second));
    if (e.kind == BeamKind::kBeam && !e.normal.isZero(0) &&
        !(e.normal.normalized().cross((q - p).normalized()).norm() > 1e-6))
      refuse(at("elements", i, "normal"), "runs along the element: axes 2 and 3 are not defined");
    const double length = e.rest_length > 0 ? e.rest_length : (q - p).norm();
    if (!(std::abs(e.rest_curvature.x()) * length <= kMaxRestTwistRad))
      refuse(
          at("elements", i, "rest_curvature"),
          fmt::format("twists the element by {:.3g} rad between its ends at rest, at most {} are "
                      "possible: take shorter elements",
                      e.rest_curvature.x() * length, kMaxRestTwistRad));
    check_releases(e, i);
  }
}

void require_frame(const Eigen::Matrix3d& axes, const Field& field) {
  if (!axes.allFinite() || !(axes.transpose() * axes).isIdentity(1e-9) || axes.determinant() < 0)
    refuse(field, "must have orthonormal, right-handed columns");
}

void check_motion_against(const BeamSupport& s, std::size_t support, const PrescribedMotion& given,
                          std::size_t i) {
  const std::optional<PrescribedMotion> m = by_axes(given, s.axes);
  if (!m)
    refuse(at("motions", i),
           fmt::format("gives directions of node {} that mix with the axes of supports[{}]: give "
                       "them by these, or all three",
                       given.node, support));
  for (std::size_t k = 0; k < 6; ++k) {
    if (s.fixed[k] && (k < 3 ? m->translates[k] : m->rotates[k - 3]))
      refuse(at("motions", i),
             fmt::format("{} node {}, which supports[{}] holds {} {}", k < 3 ? "moves" : "turns",
                         m->node, support, k < 3 ? "along" : "about", "xyz"[k % 3]));
  }
}

void require_used(const std::vector<char>& used, int node, const Field& field) {
  if (used[static_cast<std::size_t>(node)] == 0)
    refuse(field, fmt::format("= {}, a node of no element", node));
}

void check_holds(const BeamModel& model) {
  const std::vector<char> used = used_nodes(model);
  std::map<int, std::size_t> support_of, motion_of;
  for (std::size_t i = 0; i < model.supports.size(); ++i) {
    const BeamSupport& s = model.supports[i];
    require_index(s.node, model.nodes.size(), at("supports", i, "node"), "nodes");
    require_frame(s.axes, at("supports", i, "axes"));
    if (!support_of.emplace(s.node, i).second)
      refuse(at("supports", i, "node"),
             fmt::format("= {}, as that of supports[{}]", s.node, support_of[s.node]));
  }
  for (std::size_t i = 0; i < model.motions.size(); ++i) {
    const PrescribedMotion& m = model.motions[i];
    require_index(m.node, model.nodes.size(), at("motions", i, "node"), "nodes");
    require_used(used, m.node, at("motions", i, "node"));
    require_finite(m.translation, described("motions", i, "(x, y, z)"));
    require_finite(m.rotation, at("motions", i, "rotation"));
    require_frame(m.axes, at("motions", i, "axes"));
    if (!motion_of.emplace(m.node, i).second)
      refuse(at("motions", i, "node"),
             fmt::format("= {}, as that of motions[{}]", m.node, motion_of[m.node]));
    const auto support = support_of.find(m.node);
    const BeamSupport* const held =
        support == support_of.end() ? nullptr : &model.supports[support->second];
    if (held != nullptr) check_motion_against(*held, support->second, m, i);
  }
}

void check_load(const BeamModel& model, const std::vector<char>& used, const NodalLoad& load,
                const char* list, std::size_t i) {
  require_index(load.node, model.nodes.size(), at(list, i, "node"), "nodes");
  require_used(used, load.node, at(list, i, "node"));
  require_finite(load.force, at(list, i, "force"));
  require_finite(load.moment, at(list, i, "moment"));
}

void check_loads(const BeamModel& model) {
  const std::vector<char> used = used_nodes(model);
  for (std::size_t i = 0; i < model.loads.size(); ++i)
    check_load(model, used, model.loads[i], "loads", i);
  for (std::size_t i = 0; i < model.temporary_loads.size(); ++i)
    check_load(model, used, model.temporary_loads[i], "temporary_loads", i);
  for (std::size_t i = 0; i < model.distributed_loads.size(); ++i) {
    require_index(model.distributed_loads[i].element, model.elements.size(),
                  at("distributed_loads", i, "element"), "elements");
    require_finite(model.distributed_loads[i].force, at("distributed_loads", i, "force"));
  }
  require_finite(model.gravity, "gravity");
}

/// A moment needs something that takes it: at a ball joint, or about the axis of a hinge that all
/// beams have there, nothing does.
void check_moments(const BeamModel& model) {
  const auto has_moment = [](const NodalLoad& load) { return !load.moment.isZero(0); };
  if (std::none_of(model.loads.begin(), model.loads.end(), has_moment) &&
      std::none_of(model.temporary_loads.begin(), model.temporary_loads.end(), has_moment))
    return;
  const std::vector<Eigen::Matrix3d> resistances = spin_resistances(model);
  const auto check = [&](const std::vector<NodalLoad>& loads, const char* list) {
    for (std::size_t i = 0; i < loads.size(); ++i) {
      const NodalLoad& load = loads[i];
      const Eigen::Vector3d lost =
          unresisted(resistances[static_cast<std::size_t>(load.node)], load.moment);
      if (lost.norm() <= kRounding * load.moment.norm()) continue;
      const Eigen::Vector3d axis = lost.normalized();
      refuse(at(list, i, "moment"),
             fmt::format("turns node {} about ({:.3g}, {:.3g}, {:.3g}), about which no beam and no "
                         "support holds it: all beams have hinges there, or none is joined",
                         load.node, axis.x(), axis.y(), axis.z()));
    }
  };
  check(model.loads, "loads");
  check(model.temporary_loads, "temporary_loads");
}

/// Every part that hangs together needs something that holds it. Nodes of no element are no part.
void check_held(const BeamModel& model) {
  if (model.supports.empty() && model.motions.empty())
    refuse("supports", "is empty, and no motion holds the structure",
           ErrorCode::kFailedPrecondition);
  DisjointSets parts(model.nodes.size());
  for (const BeamElement& e : model.elements) parts.join(e.start, e.finish);
  std::vector<char> held(model.nodes.size(), 0);
  for (const BeamSupport& s : model.supports) {
    for (const bool fixed : s.fixed) {
      if (fixed) held[static_cast<std::size_t>(parts.lowest(s.node))] = 1;
    }
  }
  for (const PrescribedMotion& m : model.motions) {
    if (m.rotates_any() || m.translates_any())
      held[static_cast<std::size_t>(parts.lowest(m.node))] = 1;
  }
  const std::vector<char> used = used_nodes(model);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    if (used[i] != 0 && held[static_cast<std::size_t>(parts.lowest(static_cast<int>(i)))] == 0)
      refuse(at("nodes", i), "belongs to a part that no support and no motion holds",
             ErrorCode::kFailedPrecondition);
  }
}

void check_place(const BeamModel& model) {
  double shortest = kLargest;
  for (const BeamElement& e : model.elements) {
    const auto place = [&](int node) {
      return model.nodes[static_cast<std::size_t>(node)].position;
    };
    shortest = std::min(shortest, (place(e.finish) - place(e.start)).norm());
  }
  const std::vector<char> used = used_nodes(model);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const double away = model.nodes[i].position.cwiseAbs().maxCoeff();
    if (used[i] == 0 || away <= kFarthest * shortest) continue;
    refuse(at("nodes", i, "position"),
           fmt::format("is {:g} from the origin, more than {:g} times the shortest element "
                       "({:g}): move the structure there",
                       away, kFarthest, shortest));
  }
}

}  // namespace

void validate(const BeamModel& model) {
  check_nodes(model);
  check_sections(model);
  check_elements(model);
  check_place(model);
  validate_conditions(model);
}

void validate_conditions(const BeamModel& model) {
  check_holds(model);
  check_loads(model);
  check_held(model);
  check_moments(model);
}

}  // namespace limber::beams
