#include "server/kinds/bodies/checkpoint.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "engine/base/checked_number.h"
#include "server/kinds/bodies/keyframe.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/arrays.h"
#include "server/wire/snapshots.h"

namespace limber::server {
namespace {

using Pose = std::shared_ptr<const Eigen::VectorXd>;
constexpr const char* kField = "checkpoint";
constexpr int kMostNodes = 1 << 28;  // three numbers each are counted in int

/// Poses and paths of pins, each once: steps of undo share them.
class ArrayBook {
 public:
  explicit ArrayBook(proto::StoredBody& message) : message_(message) {}

  /// @returns 0: none
  [[nodiscard]] std::uint32_t number_of(const session::PinPaths& pins) {
    if (!pins) return 0;
    const auto [known, is_new] =
        pins_.try_emplace(pins.get(), static_cast<std::uint32_t>(pins_.size() + 1));
    if (is_new) *message_.add_pins() = encode_motion(*pins);
    return known->second;
  }

  void encode(const scene::Keyframe& keyframe, proto::StoredKeyframe& to) {
    *to.mutable_keyframe() = encode_keyframe(keyframe);
    const auto [known, is_new] =
        numbers_.try_emplace(keyframe.pose.get(), static_cast<std::uint32_t>(numbers_.size()));
    if (is_new)
      *message_.add_poses() =
          encode_points_float64(keyframe.pose->reshaped(3, keyframe.pose->size() / 3));
    to.set_pose(known->second);
  }

 private:
  proto::StoredBody& message_;
  std::map<const Eigen::VectorXd*, std::uint32_t> numbers_;
  std::map<const Eigen::MatrixXd*, std::uint32_t> pins_;
};

void encode_change(const session::Change& change, ArrayBook& arrays, proto::StoredBodyChange& to) {
  std::visit(
      [&](const auto& one) {
        using T = std::decay_t<decltype(one)>;
        if constexpr (std::is_same_v<T, session::ConstraintChange>) {
          if (!one.value) return to.set_remove_constraint(one.id);
          *to.mutable_constraint() = encode_constraint(*one.value);
        } else if constexpr (std::is_same_v<T, session::TargetChange>) {
          auto& moved = *to.mutable_move_constraint();
          moved.set_id(one.id);
          moved.mutable_target()->set_x(one.target.x());
          moved.mutable_target()->set_y(one.target.y());
          moved.mutable_target()->set_z(one.target.z());
        } else if constexpr (std::is_same_v<T, session::EndsChange>) {
          to.mutable_ends()->set_first_end(encode_end(one.first));
          to.mutable_ends()->set_last_end(encode_end(one.last));
        } else if constexpr (std::is_same_v<T, session::DynamicsChange>) {
          *to.mutable_dynamics() = encode_dynamics(one.dynamics);
        } else if constexpr (std::is_same_v<T, session::MaterialChange>) {
          to.mutable_fit()->set_variables(encode_variables(one.variables));
          to.mutable_fit()->set_epoch(one.epoch);
        } else if constexpr (std::is_same_v<T, session::KeyframeChange>) {
          if (!one.value) return to.set_remove_keyframe(one.id);
          arrays.encode(*one.value, *to.mutable_keyframe());
        } else if constexpr (std::is_same_v<T, session::PinsChange>) {
          to.set_pins(arrays.number_of(one.paths));
        } else {
          scene::Keyframe shifted;
          shifted.frame = one.frame;
          shifted.weight = one.weight;
          const proto::Keyframe message = encode_keyframe(shifted);
          auto& moved = *to.mutable_move_keyframe();
          moved.set_id(one.id);
          moved.set_frame(message.frame());
          if (message.has_exact()) {
            moved.set_exact(true);
          } else {
            moved.set_weight(message.weight());
          }
        }
      },
      change);
}

void encode_steps(const std::vector<session::ChangeSteps::Step>& steps, ArrayBook& arrays,
                  google::protobuf::RepeatedPtrField<proto::StoredBodyStep>& to) {
  for (const auto& step : steps) {
    auto& added = *to.Add();
    encode_step(step.note, *added.mutable_step());
    added.set_content(step.content);
    for (const session::Change& change : *step.group)
      encode_change(change, arrays, *added.add_changes());
  }
}

/// What a checkpoint has once.
struct Arrays {
  std::vector<Pose> poses;
  std::vector<session::PinPaths> pins;
};

session::PinPaths paths_at(std::uint32_t number, const Arrays& arrays) {
  if (number == 0) return nullptr;
  if (number > arrays.pins.size()) throw malformed("a checkpoint lacks the paths of pins");
  return arrays.pins[number - 1];
}

scene::Keyframe decode(const proto::StoredKeyframe& message, const std::vector<Pose>& poses) {
  if (message.pose() >= poses.size()) throw malformed("a checkpoint lacks a pose");
  proto::Keyframe keyframe = message.keyframe();
  keyframe.mutable_positions();  // replaces the pose
  Faults faults(Faults::Mode::kCollect);
  scene::Keyframe read = decode_keyframe(keyframe, kField, {}, {}, faults);
  read.pose = poses[message.pose()];
  return read;
}

/// Older builds had published differences alone, and did not say so.
scene::Dynamics decode_stored(const proto::Dynamics& dynamics) {
  return decode_dynamics(dynamics).resolved(scene::Discretisation::kDifferences);
}

session::Change decode(const proto::StoredBodyChange& message, const Arrays& arrays) {
  switch (message.change_case()) {
    case proto::StoredBodyChange::kConstraint:
      return session::ConstraintChange{message.constraint().id(),
                                       decode_constraint(message.constraint(), kField)};
    case proto::StoredBodyChange::kRemoveConstraint:
      return session::ConstraintChange{message.remove_constraint(), std::nullopt};
    case proto::StoredBodyChange::kMoveConstraint: {
      const auto& target = message.move_constraint().target();
      return session::TargetChange{message.move_constraint().id(),
                                   {target.x(), target.y(), target.z()}};
    }
    case proto::StoredBodyChange::kEnds:
      return session::EndsChange{decode_end(message.ends().first_end()),
                                 decode_end(message.ends().last_end())};
    case proto::StoredBodyChange::kDynamics:
      return session::DynamicsChange{decode_stored(message.dynamics())};
    case proto::StoredBodyChange::kFit:
      return session::MaterialChange{decode_variables(message.fit().variables()),
                                     message.fit().epoch()};
    case proto::StoredBodyChange::kKeyframe: {
      scene::Keyframe keyframe = decode(message.keyframe(), arrays.poses);
      const std::uint64_t id = keyframe.id;
      return session::KeyframeChange{id, std::move(keyframe)};
    }
    case proto::StoredBodyChange::kRemoveKeyframe:
      return session::KeyframeChange{message.remove_keyframe(), std::nullopt};
    case proto::StoredBodyChange::kMoveKeyframe: {
      const session::MoveKeyframe moved = decode_move_keyframe(message.move_keyframe(), kField);
      if (!moved.frame || !moved.weight) throw malformed("a keyframe is moved by half");
      return session::KeyframeShift{moved.id, *moved.frame, *moved.weight};
    }
    case proto::StoredBodyChange::kPins:
      return session::PinsChange{paths_at(message.pins(), arrays)};
    case proto::StoredBodyChange::CHANGE_NOT_SET:
      break;
  }
  throw malformed("a step of undo has a change without content");
}

std::vector<session::ChangeSteps::Step> decode_steps(
    const google::protobuf::RepeatedPtrField<proto::StoredBodyStep>& steps, const Arrays& arrays) {
  std::vector<session::ChangeSteps::Step> list;
  for (const auto& step : steps) {
    auto group = std::make_shared<session::ChangeGroup>();
    for (const auto& change : step.changes()) group->push_back(decode(change, arrays));
    session::ChangeSteps::Step read;
    read.group = std::move(group);
    read.content = step.content();
    read.note = decode_step(step.step());
    list.push_back(std::move(read));
  }
  return list;
}

}  // namespace

proto::StoredBody encode_body_checkpoint(const session::Document::Checkpoint& checkpoint) {
  proto::StoredBody message;
  ArrayBook arrays(message);
  auto& scene = *message.mutable_scene();
  scene.set_first_end(encode_end(checkpoint.first_end));
  scene.set_last_end(encode_end(checkpoint.last_end));
  *scene.mutable_dynamics() = encode_dynamics(checkpoint.dynamics);
  scene.mutable_material_optimisation()->set_variables(
      encode_variables(checkpoint.material.variables));
  for (const auto& constraint : checkpoint.constraints)
    *scene.add_constraints() = encode_constraint(constraint);
  for (const auto& keyframe : checkpoint.keyframes)
    arrays.encode(keyframe, *message.add_keyframes());
  encode_steps(checkpoint.undo, arrays, *message.mutable_undo());
  // From the one that redo makes first, which is the newest.
  encode_steps({checkpoint.redo.rbegin(), checkpoint.redo.rend()}, arrays, *message.mutable_redo());
  message.set_last_number(checkpoint.last_step);
  message.set_next_constraint(checkpoint.next_constraint);
  message.set_next_keyframe(checkpoint.next_keyframe);
  message.set_content(checkpoint.content);
  message.set_last_content(checkpoint.last_content);
  message.set_epoch(checkpoint.material.epoch);
  message.set_last_epoch(checkpoint.last_epoch);
  message.set_present_pins(arrays.number_of(checkpoint.pins));
  return message;
}

session::Document::Checkpoint decode_body_checkpoint(const proto::StoredBody& message,
                                                     session::Revision revision) {
  Arrays arrays;
  for (const auto& pose : message.poses())
    arrays.poses.push_back(
        std::make_shared<const Eigen::VectorXd>(decode_points(pose, kField).reshaped()));
  for (const auto& pins : message.pins()) {
    std::optional<int> frames, nodes;
    if (pins.shape_size() == 3) {
      frames = to_whole<int>(pins.shape(0));
      nodes = to_whole<int>(pins.shape(1));
    }
    if (!frames || !nodes || *frames < 1 || *nodes < 1 || *nodes > kMostNodes)
      throw malformed("a checkpoint has pins of another shape");
    arrays.pins.push_back(
        std::make_shared<const Eigen::MatrixXd>(decode_motion(pins, kField, *nodes, *frames)));
  }
  session::Document::Checkpoint read;
  read.revision = revision;
  const proto::Scene& scene = message.scene();
  read.first_end = decode_end(scene.first_end());
  read.last_end = decode_end(scene.last_end());
  read.dynamics = decode_stored(scene.dynamics());
  read.material = {decode_variables(scene.material_optimisation().variables()), message.epoch()};
  read.last_epoch = message.last_epoch();
  read.pins = paths_at(message.present_pins(), arrays);
  for (const auto& constraint : scene.constraints())
    read.constraints.push_back(decode_constraint(constraint, kField));
  for (const auto& keyframe : message.keyframes())
    read.keyframes.push_back(decode(keyframe, arrays.poses));
  read.undo = decode_steps(message.undo(), arrays);
  read.redo = decode_steps(message.redo(), arrays);
  std::reverse(read.redo.begin(), read.redo.end());
  read.last_step = message.last_number();
  read.next_constraint = message.next_constraint();
  read.next_keyframe = message.next_keyframe();
  read.content = message.content();
  read.last_content = message.last_content();
  return read;
}

}  // namespace limber::server
