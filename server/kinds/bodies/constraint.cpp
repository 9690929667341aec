#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "server/kinds/bodies/scene.h"
#include "server/wire/indices.h"
#include "server/wire/vectors.h"

namespace limber::server {

namespace {

/// Stands in for an index that is too large: as far out of range, so that it passes for no other.
constexpr int kNoIndex = std::numeric_limits<int>::max();

unsigned axis_bits(const proto::Constraint& message, const std::string& field) {
  if (message.axes_size() == 0) return 7;
  unsigned axes = 0;
  for (int i = 0; i < message.axes_size(); ++i) {
    if (message.axes(i) == proto::AXIS_UNSPECIFIED)
      throw invalid(fmt::format("{}.axes[{}]", field, i), "unspecified axis");
    if (!proto::Axis_IsValid(message.axes(i)))  // in what is stored, say
      throw invalid(fmt::format("{}.axes[{}]", field, i),
                    fmt::format("there is no axis {}", int{message.axes(i)}));
    const unsigned axis = 1u << (static_cast<unsigned>(message.axes(i)) - 1u);
    if ((axes & axis) != 0) {
      throw invalid(fmt::format("{}.axes[{}]", field, i),
                    fmt::format("{} is given twice", proto::Axis_Name(message.axes(i))));
    }
    axes |= axis;
  }
  return axes;
}

scene::PointSurface decode_surface(proto::PointSurface surface, const std::string& field) {
  switch (surface) {
    case proto::POINT_SURFACE_UNSPECIFIED:
      return scene::PointSurface::kShown;
    case proto::POINT_SURFACE_MESH:
      return scene::PointSurface::kMesh;
    case proto::POINT_SURFACE_CARRIED:
      return scene::PointSurface::kCarried;
    default:
      throw invalid(field, "no such surface");
  }
}

proto::PointSurface encode_surface(scene::PointSurface surface) {
  switch (surface) {
    case scene::PointSurface::kShown:
      return proto::POINT_SURFACE_UNSPECIFIED;
    case scene::PointSurface::kMesh:
      return proto::POINT_SURFACE_MESH;
    case scene::PointSurface::kCarried:
      return proto::POINT_SURFACE_CARRIED;
  }
  return proto::POINT_SURFACE_UNSPECIFIED;
}

scene::SurfacePoint decode_point(const proto::SurfacePoint& message, const std::string& field,
                                 Faults& faults) {
  scene::SurfacePoint point;
  point.triangle = kNoIndex;
  faults.try_to([&] { point.triangle = decode_index(message.triangle(), field + ".triangle"); });
  faults.try_to([&] { point.surface = decode_surface(message.surface(), field + ".surface"); });
  faults.try_to([&] {
    if (message.weights_size() != 3) {
      throw invalid(field + ".weights", fmt::format("three are needed, one for each corner of the "
                                                    "triangle; there are {}",
                                                    message.weights_size()));
    }
    point.weights = {message.weights(0), message.weights(1), message.weights(2)};
  });
  return point;
}

void decode_target(const proto::Constraint& message, const std::string& field,
                   scene::Constraint& constraint) {
  switch (message.target_case()) {
    case proto::Constraint::kPosition:
      constraint.kind = scene::TargetKind::kPosition;
      constraint.target = decode_vector(message.position());
      return;
    case proto::Constraint::kDisplacement:
      constraint.kind = scene::TargetKind::kDisplacement;
      constraint.target = decode_vector(message.displacement());
      return;
    case proto::Constraint::kVelocity:
      constraint.kind = scene::TargetKind::kVelocity;
      constraint.target = decode_vector(message.velocity());
      return;
    case proto::Constraint::TARGET_NOT_SET:
      break;
  }
  throw invalid(field + ".target", "a constraint needs a position, a displacement or a velocity");
}

void decode_path(const proto::Constraint& message, const std::string& field,
                 scene::Constraint& constraint, Faults& faults) {
  constraint.path.assign(static_cast<std::size_t>(message.path_size()),
                         {kNoIndex, constraint.target});
  faults.try_each(field + ".path", message.path_size(), [&](int i) {
    auto& key = constraint.path[static_cast<std::size_t>(i)];
    const proto::PathKey& from = message.path(i);
    if (i > 0) key.target = constraint.path[static_cast<std::size_t>(i - 1)].target;
    if (from.has_target()) key.target = decode_vector(from.target());
    key.frame = decode_index(from.frame(), fmt::format("{}.path[{}].frame", field, i));
  });
  if (message.has_ease_in()) constraint.ease_in = message.ease_in();
  if (message.has_ease_out()) constraint.ease_out = message.ease_out();
  if (message.has_reach()) constraint.reach = message.reach();
}

}  // namespace

scene::Constraint decode_constraint(const proto::Constraint& message, const std::string& field) {
  Faults faults(Faults::Mode::kThrow);
  return decode_constraint(message, field, faults);
}

scene::Constraint decode_constraint(const proto::Constraint& message, const std::string& field,
                                    Faults& faults) {
  scene::Constraint constraint;
  constraint.id = message.id();
  constraint.frame = kNoIndex;
  faults.try_to([&] { constraint.frame = decode_index(message.frame(), field + ".frame"); });
  constraint.nodes.assign(static_cast<std::size_t>(message.nodes_size()), kNoIndex);
  faults.try_each(field + ".nodes", message.nodes_size(), [&](int i) {
    constraint.nodes[static_cast<std::size_t>(i)] =
        decode_index(message.nodes(i), fmt::format("{}.nodes[{}]", field, i));
  });
  if (message.has_point())
    constraint.point = decode_point(message.point(), field + ".point", faults);
  if (message.has_surface_vertex()) {
    constraint.surface_vertex = kNoIndex;
    faults.try_to([&] {
      constraint.surface_vertex = decode_index(message.surface_vertex(), field + ".surface_vertex");
    });
  }
  faults.try_to([&] { constraint.axes = axis_bits(message, field); });
  faults.try_to([&] { decode_target(message, field, constraint); });
  decode_path(message, field, constraint, faults);
  if (message.enforcement_case() == proto::Constraint::kWeight) {
    constraint.weight = message.weight();
  } else if (message.enforcement_case() == proto::Constraint::kExact && message.exact()) {
    constraint.weight = std::numeric_limits<double>::infinity();
  }
  return constraint;
}

proto::Constraint encode_constraint(const scene::Constraint& constraint) {
  proto::Constraint message;
  message.set_id(constraint.id);
  message.set_frame(static_cast<std::uint32_t>(constraint.frame));
  for (const int node : constraint.nodes) message.add_nodes(static_cast<std::uint32_t>(node));
  if (constraint.point) {
    auto* const point = message.mutable_point();
    point->set_triangle(static_cast<std::uint32_t>(constraint.point->triangle));
    for (const double weight : constraint.point->weights) point->add_weights(weight);
    point->set_surface(encode_surface(constraint.point->surface));
  }
  if (constraint.surface_vertex)
    message.set_surface_vertex(static_cast<std::uint32_t>(*constraint.surface_vertex));
  if (constraint.axes != 7) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if ((constraint.axes >> axis & 1u) != 0) message.add_axes(static_cast<proto::Axis>(axis + 1));
    }
  }
  auto* target = constraint.kind == scene::TargetKind::kPosition   ? message.mutable_position()
                 : constraint.kind == scene::TargetKind::kVelocity ? message.mutable_velocity()
                                                                   : message.mutable_displacement();
  encode_vector(constraint.target, *target);
  for (const scene::PathKey& key : constraint.path) {
    proto::PathKey& made = *message.add_path();
    made.set_frame(static_cast<std::uint32_t>(key.frame));
    encode_vector(key.target, *made.mutable_target());
  }
  if (constraint.ease_in != 1) message.set_ease_in(constraint.ease_in);
  if (constraint.ease_out != 1) message.set_ease_out(constraint.ease_out);
  if (constraint.reach) message.set_reach(*constraint.reach);
  if (std::isinf(constraint.weight)) {
    message.set_exact(true);
  } else {
    message.set_weight(constraint.weight);
  }
  return message;
}

}  // namespace limber::server
