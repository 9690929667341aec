#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/bodies/elastic_body.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/site.h"
#include "engine/scene/embedding/surface_points.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/length_unit.h"
#include "engine/spacetime/material.h"
#include "engine/spacetime/problem.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// A scene in the engine's terms: SI, compact nodes.
struct MappedBody {
  bodies::ElasticBody body;
  std::vector<int> compact_of_source;  // -1 where a source node is unused
  std::vector<int> source_of_compact;
  std::vector<std::string> repairs, warnings;
};

/// @throws Error with a field of the scene ("mesh.tets[17]", "fixed_nodes[2]")
[[nodiscard]] MappedBody map_body(const scene::Scene& scene);

/// Its modes are R: at most one less than the body's elastic degrees of freedom.
[[nodiscard]] reduced::ModelOptions map_model(const scene::Scene& scene,
                                              const bodies::ElasticBody& body);

/// Lambda and D with the frame as the unit of time. With a period of L frames, lambda_k =
/// (eigenvalue_k / eigenvalue_1) (2 pi / L)^2 (space-time editing, sec. 5.2). Here eigenvalue_1 is
/// the lowest elastic one that is not a mechanism's. With L = 0, lambda_k = eigenvalue_k / fps^2.
/// Damping d_k = 2 zeta sqrt(lambda_k). Rigid unknowns: 0 and 0.
///
/// Sampled modes: d_k = 2 zeta lambda_k / sqrt(lambda_1), as of a viscous material. With one zeta
/// for all, stiff modes follow their forces at once, and an exact target is a corner of the motion:
/// forces that change smoothly have one there. Damped so, they lag behind and it is none. E_f is
/// scaled so that it does not depend on the frame rate.
/// @param eigenvalues  [1/s^2], the `rigid_count` zeros first, then those of `mechanism_count`
///   mechanisms
[[nodiscard]] spacetime::ModeDynamics map_dynamics(const scene::Dynamics& dynamics,
                                                   const Eigen::VectorXd& eigenvalues,
                                                   int rigid_count, int mechanism_count = 0);

[[nodiscard]] spacetime::EndCondition map_end(scene::End end);

/// A path is one constraint of a session and many of its solver, one a frame. Numbers of a
/// session's constraints have 53 bits, those of the frames of a path the others.
[[nodiscard]] constexpr spacetime::ConstraintId frame_of_path(std::uint64_t constraint, int frame) {
  return constraint | static_cast<std::uint64_t>(frame) << 53U;
}
[[nodiscard]] constexpr std::uint64_t constraint_of(spacetime::ConstraintId of_solver) {
  return of_solver & ((std::uint64_t{1} << 53U) - 1);
}

/// Differences of a model from its request, each with its field and the value in use; empty: none.
/// Sizes that were left to the builder are not remarked on.
[[nodiscard]] std::string model_notes(const scene::ModelRequest& request,
                                      const reduced::ReducedModel& model);

/// The material a session starts with: the first r coordinates of the model (the rigid unknowns and
/// `mode_count` elastic modes) with the dynamics of the scene.
[[nodiscard]] spacetime::Material map_material(const scene::Dynamics& dynamics, int mode_count,
                                               const reduced::ReducedModel& model);

[[nodiscard]] spacetime::MaterialVariables map_variables(scene::MaterialVariables variables);

/// Displacements [scene units] of source nodes, a pose a column, to [m] of compact nodes.
[[nodiscard]] Eigen::MatrixXd map_displacements(
    const scene::Scene& scene, const Eigen::Ref<const Eigen::MatrixXd>& displacements,
    const std::vector<int>& source_of_compact);

/// The same of the base motion, 3n x frames.
[[nodiscard]] Eigen::MatrixXd map_base_motion(const scene::Scene& scene,
                                              const std::vector<int>& source_of_compact);

/// The sites that a scene's constraints hold, and the origins of their targets. Merged duplicates
/// count once in the mean of a group.
class TargetFrame {
 public:
  /// @param scene  outlives this
  /// @param points  of the scene; null: of its own
  TargetFrame(const scene::Scene& scene, const MappedBody& mapped,
              std::shared_ptr<const scene::SurfacePoints> points = nullptr);

  /// What a constraint holds. For a group: compact ids, sorted, each once; the same group is the
  /// same site however it was written. For a point or a surface vertex: the nodes that it moves
  /// with, each once, with their weights; if it moves with one alone, that node.
  [[nodiscard]] reduced::Site site(const scene::Constraint& constraint) const;
  /// The value to subtract from a target of this kind to get a displacement [scene units]: the rest
  /// position of the site, or 0.
  [[nodiscard]] Eigen::Vector3d origin(scene::TargetKind kind, const reduced::Site& site) const;
  /// [m] from rest.
  [[nodiscard]] Eigen::Vector3d displacement(const Eigen::Vector3d& target,
                                             const Eigen::Vector3d& origin) const;

 private:
  const bodies::NodePositions& rest_;
  std::shared_ptr<const scene::SurfacePoints> points_;
  std::vector<int> compact_of_source_, source_of_compact_;
  LengthUnit unit_;
};

}  // namespace limber::session
