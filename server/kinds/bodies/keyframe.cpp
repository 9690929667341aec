#include "server/kinds/bodies/keyframe.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "server/wire/arrays.h"
#include "server/wire/indices.h"

namespace limber::server {
namespace {

constexpr double kExact = std::numeric_limits<double>::infinity();

Eigen::Matrix3Xd decode_positions(const proto::Keyframe& message, const std::string& field,
                                  const MeshLoader& load_mesh) {
  proto::MeshSource source;
  switch (message.pose_case()) {
    case proto::Keyframe::kPositions:
      return decode_points(message.positions(), field + ".positions");
    case proto::Keyframe::kFile:
      *source.mutable_file() = message.file();
      break;
    case proto::Keyframe::kPath:
      source.set_path(message.path());
      break;
    case proto::Keyframe::POSE_NOT_SET:
      throw invalid(field + ".positions", "a keyframe needs a pose: positions, file or path");
  }
  return load_mesh(source, field).mesh.nodes;
}

Eigen::VectorXd decode_pose(const proto::Keyframe& message, const std::string& field,
                            const bodies::NodePositions& rest, const MeshLoader& load_mesh) {
  const Eigen::Matrix3Xd positions = decode_positions(message, field, load_mesh);
  if (rest.cols() == 0) return {};
  if (positions.cols() != rest.cols()) {
    throw invalid(field + "." + pose_name(message),
                  fmt::format("has {} nodes, the mesh has {}", positions.cols(), rest.cols()));
  }
  return (positions - rest).reshaped();
}

}  // namespace

scene::Keyframe decode_keyframe(const proto::Keyframe& message, const std::string& field,
                                const bodies::NodePositions& rest, const MeshLoader& load_mesh,
                                Faults& faults) {
  scene::Keyframe keyframe;
  keyframe.id = message.id();
  keyframe.frame = std::numeric_limits<int>::max();
  faults.try_to([&] { keyframe.frame = decode_index(message.frame(), field + ".frame"); });
  Eigen::VectorXd pose = Eigen::VectorXd::Zero(rest.size());
  faults.try_to([&] { pose = decode_pose(message, field, rest, load_mesh); });
  keyframe.pose = std::make_shared<const Eigen::VectorXd>(std::move(pose));
  if (message.enforcement_case() == proto::Keyframe::kWeight) {
    keyframe.weight = message.weight();
  } else if (message.enforcement_case() == proto::Keyframe::kExact && message.exact()) {
    keyframe.weight = kExact;
  }
  return keyframe;
}

proto::Keyframe encode_keyframe(const scene::Keyframe& keyframe) {
  proto::Keyframe message;
  message.set_id(keyframe.id);
  message.set_frame(static_cast<std::uint32_t>(keyframe.frame));
  if (std::isinf(keyframe.weight)) {
    message.set_exact(true);
  } else {
    message.set_weight(keyframe.weight);
  }
  return message;
}

proto::Array encode_pose(const scene::Keyframe& keyframe, const bodies::NodePositions& rest) {
  return encode_points_float64(keyframe.pose->reshaped(3, rest.cols()) + rest);
}

void encode_poses(const scene::Scene& scene, proto::Scene& message) {
  for (std::size_t i = 0; i < scene.keyframes.size(); ++i) {
    *message.mutable_keyframes(static_cast<int>(i))->mutable_positions() =
        encode_pose(scene.keyframes[i], scene.mesh.nodes);
  }
}

session::MoveKeyframe decode_move_keyframe(const proto::MoveKeyframe& message,
                                           const std::string& field) {
  session::MoveKeyframe move{message.id(), {}, {}};
  if (message.has_frame()) move.frame = decode_index(message.frame(), field + ".frame");
  if (message.enforcement_case() == proto::MoveKeyframe::kWeight) {
    move.weight = message.weight();
  } else if (message.enforcement_case() == proto::MoveKeyframe::kExact) {
    if (!message.exact())
      throw invalid(field + ".exact", "only true has a meaning; a weight makes it soft again");
    move.weight = kExact;
  }
  if (!move.frame && !move.weight)
    throw invalid(field, "neither a frame nor a weight: nothing would change");
  return move;
}

const char* pose_name(const proto::Keyframe& message) {
  if (message.has_file()) return "file";
  return message.has_path() ? "path" : "positions";
}

}  // namespace limber::server
