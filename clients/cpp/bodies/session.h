#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/bodies/picking.h"
#include "clients/cpp/frames.h"
#include "clients/cpp/open_session.h"

namespace limber::client {

/// Frequency and damping of a body's motion; members that are not given stay unchanged.
struct DynamicsChange {
  std::optional<double> frames_per_second;
  std::optional<double> period_frames;  // of the lowest elastic mode; 0: as the materials say
  std::optional<double> damping_ratio;  // of critical, in [0, 1): of the lowest mode
  std::optional<v1::TimeDiscretisation> discretisation;
  std::optional<double> force_smoothing;  // [s], >= 0
  std::optional<double> inertia;          // under a base motion, in [0, 10]
};

/// Change of a keyframe; members that are not given stay unchanged.
struct KeyframeMove {
  std::optional<unsigned> frame;
  std::optional<double> weight;  // gamma > 0, from now on soft; not with is_exact
  bool is_exact = false;         // held exactly from now on
};

/// Use of the material that was fitted so far.
enum class FittedMaterial {
  kKept,
  kForgotten,  // back to the scene's own
};

/// A session of an elastic body: constraints and keyframes, and the motion that comes of them.
/// Nodes and frames count from 0, positions are in the scene's length unit.
class BodySession : public OpenSession {
 public:
  /// A session that is there already, of any client, as NAME or NAME@UID; nothing is sent.
  BodySession(Client& client, std::string session, Naming naming = Naming::kByUid);
  /// Opens a scene with a body and waits until its model is built and its motion found.
  /// @throws ClientError as open_session
  static BodySession open(Client& client, const v1::Scene& scene, const std::string& session = "",
                          Milliseconds timeout = kPatience);

  /// Those of every client, as of now.
  [[nodiscard]] std::vector<v1::Constraint> constraints();
  /// The same, without their poses.
  [[nodiscard]] std::vector<v1::Keyframe> keyframes();

  /// Adds a constraint; the session chooses its id (constraint_ids) where it has none.
  v1::EditResponse add(const v1::Constraint& constraint);
  /// Puts a constraint in the place of that with its id.
  v1::EditResponse replace(const v1::Constraint& constraint);
  /// Another target: a position, a displacement or a velocity, as the constraint has it.
  v1::EditResponse move(std::uint64_t constraint, const Vector& target);
  /// As one revision.
  v1::EditResponse remove(const std::vector<std::uint64_t>& constraints);
  /// End conditions of the motion at its first and last frame.
  v1::EditResponse ends(v1::EndCondition first, v1::EndCondition last);
  /// Edits of others are not undone by the unchanged values. These are read and sent with the edit,
  /// until no other client has edited in between, for 10 s at most.
  v1::EditResponse dynamics(const DynamicsChange& change);

  /// Other paths of the scene's fixed nodes in place of its base motion, frames x fixed nodes x 3
  /// float64 [length unit]; empty: the scene's base motion again.
  v1::EditResponse move_pins(const v1::Array& positions);

  /// Adds a keyframe; its id is in keyframe_ids. @param keyframe  with its pose
  v1::EditResponse add_keyframe(const v1::Keyframe& keyframe);
  v1::EditResponse move_keyframe(std::uint64_t keyframe, const KeyframeMove& move);
  /// As one revision.
  v1::EditResponse remove_keyframes(const std::vector<std::uint64_t>& keyframes);

  /// Variables that are optimised from now on; MOTION freezes the material.
  v1::EditResponse optimise(v1::MaterialVariables variables,
                            FittedMaterial fitted = FittedMaterial::kKept);
  /// Discards fitted values: the scene's own material, from which optimisation starts anew.
  v1::EditResponse reset_material();
  /// That of the newest result in SI units.
  [[nodiscard]] v1::GetMaterialResponse material();

  /// Positions of all frames of the newest result.
  [[nodiscard]] Positions positions();
  // Picking: at rest, or in a frame of the newest result.
  /// @param surface  UNSPECIFIED: that which the scene names, else the mesh's
  /// @throws ClientError FAILED_PRECONDITION if the scene names none and CARRIED is requested
  [[nodiscard]] DrawnSurface surface(std::optional<std::uint32_t> frame = {},
                                     v1::PointSurface surface = v1::POINT_SURFACE_UNSPECIFIED);
  /// The point of a surface that is nearest to a position, for Constraint.point.
  [[nodiscard]] PickedPoint nearest_surface_point(
      const Vector& position, std::optional<std::uint32_t> frame = {},
      v1::PointSurface surface = v1::POINT_SURFACE_UNSPECIFIED);
  /// Nodes of tets in a box with sides along the axes, its faces included, ascending.
  [[nodiscard]] std::vector<std::uint32_t> nodes_in_box(const Vector& low, const Vector& high,
                                                        std::optional<std::uint32_t> frame = {});

  /// Solves the problem again from the base motion; the better of the two motions stays.
  /// @returns the job
  std::uint64_t solve_cold();
  /// Frames of a long motion that come first after every edit, on changes_topic(); frame_count 0:
  /// to the last one, at most 4096. The newest 8 such requests count. @throws ClientError
  /// OUT_OF_RANGE
  void look_at(std::uint32_t first_frame, std::uint32_t frame_count = 0);

 private:
  [[nodiscard]] v1::GetGeometryResponse geometry_with_surface();
  [[nodiscard]] std::vector<double> positions_in(std::uint32_t frame, v1::Encoding encoding);

  std::optional<v1::GetGeometryResponse> geometry_;  // of the newest basis seen
};

}  // namespace limber::client
