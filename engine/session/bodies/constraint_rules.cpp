#include "engine/session/bodies/constraint_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/scene/constraint_path.h"

namespace limber::session {
namespace {

using scene::End;

void demand_range(const char* field, double value, double low, double high, const char* rule) {
  // Written so that NaN fails.
  if (!(value >= low && value <= high)) {
    throw Error(ErrorCode::kInvalidArgument, field, fmt::format("must be {}, is {}", rule, value));
  }
}

}  // namespace

ConstraintRules::ConstraintRules(const scene::Scene& scene,
                                 std::shared_ptr<const scene::SurfacePoints> points)
    : frame_count_(scene.frame_count),
      points_(points ? std::move(points) : std::make_shared<const scene::SurfacePoints>(scene)),
      reach_(0),
      used_(scene.mesh.nodes.cols(), 0),
      fixed_(scene.mesh.nodes.cols(), 0) {
  for (const int node : scene.fixed_nodes)
    if (node >= 0 && node < static_cast<int>(fixed_.size())) fixed_[node] = 1;
  for (Eigen::Index e = 0; e < scene.mesh.tets.cols(); ++e) {
    for (int c = 0; c < 4; ++c) {
      const int node = scene.mesh.tets(c, e);
      if (node >= 0 && node < static_cast<int>(used_.size())) used_[node] = 1;
    }
  }
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (!used_[i]) continue;
    low = low.cwiseMin(scene.mesh.nodes.col(i));
    high = high.cwiseMax(scene.mesh.nodes.col(i));
  }
  if ((low.array() <= high.array()).all()) {
    // Positions may be far from the origin: what counts is the distance from the body.
    reach_ = kFarthestTarget * (high - low).maxCoeff() +
             std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  }
}

void ConstraintRules::check(const scene::Constraint& constraint) const {
  check_frame(constraint.frame);
  check_place(constraint);
  check_axes(constraint.axes);
  if (constraint.kind != scene::TargetKind::kDisplacement &&
      constraint.kind != scene::TargetKind::kPosition &&
      constraint.kind != scene::TargetKind::kVelocity) {
    throw Error(ErrorCode::kInvalidArgument, "kind",
                "the kind of target is neither displacement nor position nor velocity");
  }
  check_target(constraint.target);
  scene::check_path(constraint, frame_count_);
  for (const scene::PathKey& key : constraint.path) check_target(key.target);
  check_weight(constraint.weight);
}

void ConstraintRules::check_frame(int frame) const {
  if (frame >= 0 && frame < frame_count_) return;
  throw Error(ErrorCode::kOutOfRange, "frame",
              fmt::format("frame {} is outside 0 .. {}", frame, frame_count_ - 1));
}

void ConstraintRules::check_axes(unsigned axes) {
  if (axes > 0 && axes <= 7) return;
  throw Error(
      ErrorCode::kInvalidArgument, "axes",
      fmt::format("must name at least one of x (1), y (2), z (4) and nothing else, is {}", axes));
}

void ConstraintRules::check_weight(double weight) {
  if (!(weight > 0)) {
    throw Error(ErrorCode::kInvalidArgument, "weight",
                fmt::format("must be > 0, is {} ({})", weight, scene::kHowToHoldExactly));
  }
  if (std::isfinite(weight) && (weight < kLeastWeight || weight > scene::kGreatestWeight)) {
    throw Error(ErrorCode::kOutOfRange, "weight",
                fmt::format("must be in [{}, {}], is {} ({})", kLeastWeight, scene::kGreatestWeight,
                            weight, scene::kHowToHoldExactly));
  }
}

std::vector<scene::Issue> ConstraintRules::warnings(const scene::Constraint& constraint, End first,
                                                    End last) const {
  constexpr auto kWarning = scene::Issue::Severity::kWarning;
  std::vector<scene::Issue> found;
  if (const auto text = scene::idle_frame_warning(constraint, frame_count_, first, last))
    found.push_back({kWarning, "frame", *text});
  const scene::NodeMean held = points_->nodes_of(constraint);
  if (scene::is_fixed(held, [&](int node) { return fixed_[node] != 0; })) {
    const char* const field = constraint.point            ? "point"
                              : constraint.surface_vertex ? "surface_vertex"
                                                          : "nodes";
    found.push_back({kWarning, field,
                     held.weights.empty() ? scene::kIdleNodesWarning : scene::kIdlePointWarning});
  }
  return found;
}

bool ConstraintRules::can_check_place(const scene::Constraint& constraint) const {
  return points_->can_check(constraint);
}

void ConstraintRules::check_place(const scene::Constraint& constraint) const {
  points_->check(constraint);
  if (!constraint.nodes.empty()) check_nodes(constraint.nodes);
}

void ConstraintRules::check_nodes(const std::vector<int>& nodes) const {
  const int count = static_cast<int>(used_.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i] < 0 || nodes[i] >= count) {
      throw Error(ErrorCode::kOutOfRange, fmt::format("nodes[{}]", i),
                  fmt::format("node {} is outside 0 .. {}", nodes[i], count - 1));
    }
    if (!used_[nodes[i]]) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("nodes[{}]", i),
                  fmt::format("node {} belongs to no tet, it cannot be moved", nodes[i]));
    }
  }
  if (nodes.size() < 2) return;
  std::vector<int> order(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) order[i] = static_cast<int>(i);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return nodes[a] < nodes[b]; });
  const auto same = [&](int a, int b) { return nodes[a] == nodes[b]; };
  const auto twin = std::adjacent_find(order.begin(), order.end(), same);
  if (twin != order.end()) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("nodes[{}]", *(twin + 1)),
                fmt::format("node {} is named twice in the group", nodes[*twin]));
  }
}

void ConstraintRules::check_target(const Eigen::Vector3d& target) const {
  if (!target.allFinite()) {
    throw Error(
        ErrorCode::kInvalidArgument, "target",
        fmt::format("target ({}, {}, {}) is not finite", target.x(), target.y(), target.z()));
  }
  if (target.cwiseAbs().maxCoeff() > reach_) {
    throw Error(ErrorCode::kOutOfRange, "target",
                fmt::format("target ({}, {}, {}) is more than {} body lengths away", target.x(),
                            target.y(), target.z(), kFarthestTarget));
  }
}

void ConstraintRules::check_ends(End first, End last) const {
  const std::optional<int> at_first = scene::pinned_frames(first);
  const std::optional<int> at_last = scene::pinned_frames(last);
  if (!at_first) throw Error(ErrorCode::kInvalidArgument, "first_end", "no such end condition");
  if (!at_last) throw Error(ErrorCode::kInvalidArgument, "last_end", "no such end condition");
  if ((first == End::kCyclic) != (last == End::kCyclic))
    throw Error(ErrorCode::kInvalidArgument, "last_end", scene::kEndsOfCycle);
  const int held = *at_first + *at_last;
  if (held >= frame_count_) {
    throw Error(ErrorCode::kInvalidArgument, "last_end",
                fmt::format("the ends hold {} frames, the scene has {}: no frame is left to move",
                            held, frame_count_));
  }
}

void ConstraintRules::check_dynamics(const scene::Dynamics& dynamics) {
  check_frames_per_second(dynamics);
  check_period(dynamics);
  check_damping(dynamics);
  check_smoothing(dynamics);
  check_inertia(dynamics);
}

void ConstraintRules::check_frames_per_second(const scene::Dynamics& dynamics) {
  demand_range("frames_per_second", dynamics.frames_per_second, 1e-6, 1e9, "in [1e-6, 1e9]");
}

void ConstraintRules::check_period(const scene::Dynamics& dynamics) {
  if (dynamics.period_frames == 0) return;
  demand_range("period_frames", dynamics.period_frames, 1e-3, 1e9,
               "in [1e-3, 1e9], or 0 for the period that follows from the materials");
}

void ConstraintRules::check_damping(const scene::Dynamics& dynamics) {
  demand_range("damping_ratio", dynamics.damping_ratio, 0, std::nextafter(1.0, 0.0), "in [0, 1)");
}

void ConstraintRules::check_smoothing(const scene::Dynamics& dynamics) {
  const double most = 1e6 / dynamics.frames_per_second;
  demand_range("force_smoothing", dynamics.force_smoothing, 0, most,
               fmt::format("in [0, {:g}] s (1e6 frames)", most).c_str());
}

void ConstraintRules::check_inertia(const scene::Dynamics& dynamics) {
  demand_range("inertia", dynamics.inertia, 0, scene::Dynamics::kGreatestInertia, "in [0, 10]");
  if (dynamics.inertia > 0 && dynamics.discretisation == scene::Discretisation::kDifferences) {
    throw Error(ErrorCode::kInvalidArgument, "inertia",
                "needs sampled modes (dynamics.discretisation)");
  }
}

}  // namespace limber::session
