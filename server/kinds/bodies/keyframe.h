#pragma once

#include <string>

#include "engine/scene/scene.h"
#include "engine/session/bodies/edit.h"
#include "limber/v1/scene.pb.h"
#include "limber/v1/service.pb.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/faults.h"

namespace limber::server {

/// @param rest  nodes of the scene's mesh; none: it could not be read, and no pose is compared with
/// it
/// @param load_mesh  reads a pose that is a file; fields as those of a mesh
/// @throws Refusal or Error with a path below `field`, where `faults` throws; else what could not
/// be read has a default in its place: the rest shape for a pose
[[nodiscard]] scene::Keyframe decode_keyframe(const proto::Keyframe& message,
                                              const std::string& field,
                                              const bodies::NodePositions& rest,
                                              const MeshLoader& load_mesh, Faults& faults);
/// Without its pose, which may be megabytes.
[[nodiscard]] proto::Keyframe encode_keyframe(const scene::Keyframe& keyframe);
/// The pose as positions, float64.
[[nodiscard]] proto::Array encode_pose(const scene::Keyframe& keyframe,
                                       const bodies::NodePositions& rest);
/// Poses of all keyframes of a message made by encode_scene().
void encode_poses(const scene::Scene& scene, proto::Scene& message);

[[nodiscard]] session::MoveKeyframe decode_move_keyframe(const proto::MoveKeyframe& message,
                                                         const std::string& field);

/// The field of a pose as the message gives it.
[[nodiscard]] const char* pose_name(const proto::Keyframe& message);

}  // namespace limber::server
