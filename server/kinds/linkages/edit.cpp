#include "server/kinds/linkages/edit.h"

#include <fmt/format.h>

#include "server/kinds/linkages/scene.h"
#include "server/wire/arrays.h"
#include "server/wire/edits.h"
#include "server/wire/indices.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

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
    edit.angle = decode_angle(message.angle_degrees(), field + ".angle_degrees", edit.joint);
  return edit;
}

session::LinkageEdit decode_set_mean_angle(const proto::SetMeanAngle& message,
                                           const std::string& field) {
  session::SetMeanAngle edit;
  if (message.has_angle_degrees())
    edit.angle = decode_angle(message.angle_degrees(), field + ".angle_degrees");
  return edit;
}

session::LinkageEdit decode_linkage_edit(const proto::Edit& message, const std::string& field) {
  const auto* kind = edit_kind(message);
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
    case proto::Edit::kSetErection:
      if (!message.set_erection().has_erection()) return session::SetErection{};
      return session::SetErection{
          decode_erection(message.set_erection().erection(), path + ".erection")};
    case proto::Edit::kUndo:
      return session::Undo{whose(message.undo().anyone())};
    case proto::Edit::kRedo:
      return session::Redo{whose(message.redo().anyone())};
    default:
      throw invalid(path, "this is no edit of rod linkages, and the session is of one");
  }
}

}  // namespace

std::vector<session::LinkageEdit> decode_linkage_edits(const proto::EditRequest& request) {
  if (request.edits_size() == 0) throw invalid("edits", "a request needs at least one edit");
  std::vector<session::LinkageEdit> edits;
  edits.reserve(static_cast<std::size_t>(request.edits_size()));
  for (int i = 0; i < request.edits_size(); ++i)
    edits.push_back(decode_linkage_edit(request.edits(i), fmt::format("edits[{}]", i)));
  return edits;
}

proto::EditResponse encode_linkage_receipt(const session::EditReceipt& receipt) {
  proto::EditResponse response = begin_response(receipt);
  for (const auto id : receipt.constraint_ids) {
    response.add_target_ids(id);
    response.add_constraint_ids(0);
    response.add_keyframe_ids(0);
  }
  return response;
}

}  // namespace limber::server
