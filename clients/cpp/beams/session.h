#pragma once

#include <array>
#include <optional>
#include <string>

#include "clients/cpp/frames.h"
#include "clients/cpp/open_session.h"

namespace limber::client {

/// Displacement of a node: x, y, z from its drawn position [m] and a rotation vector from rest
/// [radian], or in its place rotations about single axes. Members that are not given stay
/// unchanged.
struct BeamMove {
  std::optional<double> x, y, z;
  std::optional<Vector> position;  // in place of x, y, z: a point [m]
  std::optional<std::array<double, 3>> rotation;
  std::optional<double> rotation_x, rotation_y, rotation_z;
  /// Two directions in place of x and y, the third is perpendicular to both; those of the node's
  /// support where that has some.
  std::optional<std::array<Vector, 2>> axes;
};

/// Direction of a load if the node or element that it acts on turns.
enum class LoadDirection {
  kFixed,    // it keeps its direction in space
  kFollows,  // it turns along
};

/// A session of a structure of beams: edits, and their results. Nodes and elements count from 0, SI
/// units. The equilibrium that wait() waits for is followed from the previous one; `beams()` of its
/// result says how the solve went and where it snapped.
class BeamSession : public OpenSession {
 public:
  /// A session that is there already, of any client, as NAME or NAME@UID; nothing is sent.
  BeamSession(Client& client, std::string session, Naming naming = Naming::kByUid);
  /// Opens a scene with a structure of beams and waits until it is in equilibrium.
  /// @throws ClientError as open_session
  static BeamSession open(Client& client, const v1::Scene& scene, const std::string& session = "",
                          Milliseconds timeout = kPatience);

  /// Supports, motions and loads of every client, as of now.
  [[nodiscard]] v1::BeamStructure structure();

  /// Brings a node somewhere, whether a support held it or not, and holds it there.
  v1::EditResponse move_support(unsigned node, const BeamMove& move);
  /// Replaces the node's support; if nothing is fixed, it is removed.
  v1::EditResponse support(const v1::BeamSupport& support);
  /// Holds a node where it is, once it is at rest.
  v1::EditResponse hold(unsigned node);
  /// Takes the node's support and motion away.
  v1::EditResponse release(unsigned node);
  /// Replaces the loads of the node [N], [N m]; zeros remove them.
  v1::EditResponse load(unsigned node, const Vector& force, const Vector& moment = {},
                        LoadDirection direction = LoadDirection::kFixed);
  /// Replaces the distributed load of the element [N/m].
  v1::EditResponse element_load(unsigned element, const Vector& force,
                                LoadDirection direction = LoadDirection::kFixed);
  /// Loads the node [N], [N m] and takes that away again: does the structure come back, or snap to
  /// another shape?
  v1::EditResponse push(unsigned node, const Vector& force, const Vector& moment = {});

  /// Nodes of the shapes along the path of the newest result, the shape itself last.
  [[nodiscard]] Positions positions();
  /// Reactions, forces, stresses of the newest equilibrium.
  [[nodiscard]] v1::BeamSolution solution();
};

}  // namespace limber::client
