#include "server/codec/linkage_edit.h"

#include <fmt/format.h>

#include <charconv>

#include "server/codec/arrays.h"
#include "server/codec/linkage.h"
#include "server/codec/scene.h"

namespace limber::server {
namespace {

const google::protobuf::FieldDescriptor* kind_of(const proto::Edit& edit) {
  return edit.GetReflection()->GetOneofFieldDescriptor(
      edit, proto::Edit::descriptor()->FindOneofByName("edit"));
}

void demand(bool given, const std::string& field) {
  if (!given) throw invalid(field, "missing");
}

session::LinkageEdit decode_pin_joint(const proto::PinJoint& message, const std::string& field) {
  demand(message.has_pin(), field + ".pin");
  const scene::JointPin pin = decode_pin(message.pin(), field + ".pin");
  if (message.pin().held() != proto::HELD_NOTHING)
    return session::PinJoint{pin.joint, pin.held, pin.position};
  if (pin.position) throw invalid(field + ".pin.position", "a joint is released where it is");
  return session::PinJoint{pin.joint, {}, {}};
}

session::LinkageEdit decode_set_joint_angle(const proto::SetJointAngle& message,
                                            const std::string& field) {
  session::SetJointAngle edit;
  edit.joint = decode_index(message.joint(), field + ".joint");
  if (message.has_angle_degrees())
    edit.angle = decode_angle(message.angle_degrees(), field + ".angle_degrees");
  return edit;
}

session::LinkageEdit decode_set_mean_angle(const proto::SetMeanAngle& message,
                                           const std::string& field) {
  session::SetMeanAngle edit;
  if (message.has_angle_degrees())
    edit.angle = decode_angle(message.angle_degrees(), field + ".angle_degrees");
  return edit;
}

session::LinkageEdit decode_edit(const proto::Edit& message, const std::string& field) {
  const auto* kind = kind_of(message);
  if (kind == nullptr) throw invalid(field, "an edit without content");
  const std::string path = field + "." + kind->name();
  switch (message.edit_case()) {
    case proto::Edit::kPinJoint:
      return decode_pin_joint(message.pin_joint(), path);
    case proto::Edit::kSetJointAngle:
      return decode_set_joint_angle(message.set_joint_angle(), path);
    case proto::Edit::kSetMeanAngle:
      return decode_set_mean_angle(message.set_mean_angle(), path);
    case proto::Edit::kAddTarget:
      demand(message.add_target().has_target(), path + ".target");
      return session::AddTarget{decode_target(message.add_target().target(), path + ".target")};
    case proto::Edit::kMoveTarget:
      demand(message.move_target().has_position(), path + ".position");
      return session::MoveTarget{message.move_target().id(),
                                 decode_vector(message.move_target().position())};
    case proto::Edit::kReplaceTarget:
      demand(message.replace_target().has_target(), path + ".target");
      return session::ReplaceTarget{
          decode_target(message.replace_target().target(), path + ".target")};
    case proto::Edit::kRemoveTarget:
      return session::RemoveTarget{message.remove_target().id()};
    case proto::Edit::kSetJointLoad:
      demand(message.set_joint_load().has_load(), path + ".load");
      return session::SetJointLoad{decode_load(message.set_joint_load().load(), path + ".load")};
    case proto::Edit::kSetGravity:
      return session::SetGravity{decode_vector(message.set_gravity().gravity())};
    case proto::Edit::kSetSegmentLengths:
      return session::SetSegmentLengths{decode_numbers(message.set_segment_lengths().lengths())};
    case proto::Edit::kSetEdgeLengths:
      return session::SetEdgeLengths{decode_numbers(message.set_edge_lengths().lengths())};
    case proto::Edit::kSetSectionScales:
      return session::SetSectionScales{decode_numbers(message.set_section_scales().scales())};
    case proto::Edit::kUndo:
      return session::Undo{};
    case proto::Edit::kRedo:
      return session::Redo{};
    default:
      throw invalid(path, "is an edit of elastic bodies: this session is of a rod linkage");
  }
}

/// Where the values of an edit are: a message in it, or the edit itself.
const google::protobuf::FieldDescriptor* values_of(const google::protobuf::Descriptor& edit) {
  for (const char* name : {"pin", "target", "load"}) {
    if (const auto* inner = edit.FindFieldByName(name)) return inner;
  }
  return nullptr;
}

/// Names of scene::LinkageConditions as the messages have them; empty: of none of their own.
std::string name_in(const google::protobuf::Descriptor& message, const std::string& name) {
  for (const std::string what : {"segment_lengths", "edge_lengths", "section_scales"})
    if (name.starts_with(what)) return name.substr(what.find('_') + 1);
  if (name == "angle" || name == "mean_angle") return name_in(message, "angle_degrees");
  if (message.FindFieldByName("segment") != nullptr && (name == "segment" || name == "share"))
    return "segment." + name;
  return message.FindFieldByName(name) != nullptr ? name : "";
}

}  // namespace

std::vector<session::LinkageEdit> decode_linkage_edits(const proto::EditRequest& request) {
  if (request.edits_size() == 0) throw invalid("edits", "a request needs at least one edit");
  std::vector<session::LinkageEdit> edits;
  edits.reserve(static_cast<std::size_t>(request.edits_size()));
  for (int i = 0; i < request.edits_size(); ++i)
    edits.push_back(decode_edit(request.edits(i), fmt::format("edits[{}]", i)));
  return edits;
}

proto::EditResponse encode_linkage_receipt(const session::EditReceipt& receipt) {
  proto::EditResponse response;
  response.set_revision(receipt.revision);
  for (const auto id : receipt.constraint_ids) {
    response.add_target_ids(id);
    response.add_constraint_ids(0);
    response.add_keyframe_ids(0);
  }
  return response;
}

std::string linkage_field_in(const proto::EditRequest& message, const std::string& field) {
  const std::string opening = "edits[";
  if (!field.starts_with(opening)) return field;
  int index = -1;
  const char* const end = field.data() + field.size();
  const char* const stop = std::from_chars(field.data() + opening.size(), end, index).ptr;
  if (stop == end || *stop != ']' || index < 0 || index >= message.edits_size()) return field;
  const auto* kind = kind_of(message.edits(index));
  if (kind == nullptr) return field;
  std::string path = fmt::format("edits[{}].{}", index, kind->name());
  const auto* descriptor = kind->message_type();
  if (const auto* inner = values_of(*descriptor)) {
    path += "." + inner->name();
    descriptor = inner->message_type();
  }
  const std::string rest(stop + 1, end);
  const std::string name =
      rest.empty() ? "" : name_in(*descriptor, rest.substr(rest.rfind('.') + 1));
  return name.empty() ? path : path + "." + name;
}

}  // namespace limber::server
