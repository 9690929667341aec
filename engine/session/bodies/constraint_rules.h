#pragma once

#include <memory>
#include <vector>

#include "engine/scene/embedding/surface_points.h"
#include "engine/scene/scene.h"

namespace limber::session {

/// Rules on the values that edits set in a given scene. Every check throws an Error whose field is
/// relative to the value checked ("frame", "nodes[2]"); the caller puts its own path before it.
class ConstraintRules {
 public:
  static constexpr double kFarthestTarget = 1e6;  // [body lengths], velocities: a second
  static constexpr double kLeastWeight = 1e-30;

  /// @param points  of the scene, or of one with its mesh and surface; null: of its own, and the
  /// scene outlives this
  explicit ConstraintRules(const scene::Scene& scene,
                           std::shared_ptr<const scene::SurfacePoints> points = nullptr);

  void check(const scene::Constraint& constraint) const;
  void check_target(const Eigen::Vector3d& target) const;
  void check_ends(scene::End first, scene::End last) const;
  static void check_dynamics(const scene::Dynamics& dynamics);

  // The parts of check() and check_dynamics(), for callers that collect all errors.
  void check_frame(int frame) const;
  /// Checks the held place: nodes, a point or a surface vertex.
  void check_place(const scene::Constraint& constraint) const;
  /// False where the mesh cannot be prepared and the constraint is on its surface.
  [[nodiscard]] bool can_check_place(const scene::Constraint& constraint) const;
  static void check_axes(unsigned axes);
  static void check_weight(double weight);
  static void check_frames_per_second(const scene::Dynamics& dynamics);
  static void check_period(const scene::Dynamics& dynamics);
  static void check_damping(const scene::Dynamics& dynamics);
  static void check_smoothing(const scene::Dynamics& dynamics);
  static void check_inertia(const scene::Dynamics& dynamics);

  /// Why a constraint that check() accepts moves nothing: its frame is held by an end, all its
  /// nodes are fixed. Fields as in check().
  [[nodiscard]] std::vector<scene::Issue> warnings(const scene::Constraint& constraint,
                                                   scene::End first, scene::End last) const;

 private:
  int frame_count_;
  void check_nodes(const std::vector<int>& nodes) const;

  std::shared_ptr<const scene::SurfacePoints> points_;
  double reach_;             // bound of |target_axis| [scene length unit], velocities: a second
  std::vector<char> used_;   // per source node
  std::vector<char> fixed_;  // per source node
};

}  // namespace limber::session
