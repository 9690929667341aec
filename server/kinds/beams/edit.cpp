#include "server/kinds/beams/edit.h"

#include <fmt/format.h>

#include "server/kinds/beams/structure.h"
#include "server/wire/edits.h"
#include "server/wire/indices.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

void require_given(bool given, const std::string& field) {
  if (!given) throw invalid(field, "missing");
}

session::BeamEdit decode_node_move(const proto::MoveBeamNode& message, const std::string& field,
                                   const std::vector<beams::BeamNode>& nodes) {
  require_given(message.has_motion(), field + ".motion");
  session::MoveNode edit{decode_beam_motion(message.motion(), field + ".motion")};
  if (!message.has_position()) return edit;
  const auto& given = message.motion();
  if (given.has_x() || given.has_y() || given.has_z())
    throw invalid(field + ".position", "is in place of motion.x, y and z, not beside them");
  const auto node = static_cast<std::size_t>(edit.motion.node);
  if (node >= nodes.size()) return edit;  // refused by the document, which says how many there are
  edit.motion.translates = {true, true, true};
  edit.motion.translation =
      edit.motion.axes.transpose() * (decode_vector(message.position()) - nodes[node].position);
  return edit;
}

session::BeamEdit decode_hold(const proto::HoldBeamNode& message, const std::string& field) {
  session::HoldNode edit;
  edit.node = decode_index(message.node(), field + ".node");
  if (!message.x() && !message.y() && !message.z() && !message.rotations()) return edit;
  edit.translations = {message.x(), message.y(), message.z()};
  edit.rotations = message.rotations();
  return edit;
}

session::BeamEdit decode_beam_edit(const proto::Edit& message, const std::string& field,
                                   const std::vector<beams::BeamNode>& nodes) {
  const auto* kind = edit_kind(message);
  if (kind == nullptr) throw invalid(field, "an edit without content");
  const std::string path = field + "." + kind->name();
  switch (message.edit_case()) {
    case proto::Edit::kSetBeamSupport:
      require_given(message.set_beam_support().has_support(), path + ".support");
      return session::SetSupport{
          decode_support(message.set_beam_support().support(), path + ".support")};
    case proto::Edit::kMoveBeamNode:
      return decode_node_move(message.move_beam_node(), path, nodes);
    case proto::Edit::kReleaseBeamNode:
      return session::ReleaseNode{decode_index(message.release_beam_node().node(), path + ".node")};
    case proto::Edit::kHoldBeamNode:
      return decode_hold(message.hold_beam_node(), path);
    case proto::Edit::kSetBeamLoad:
      require_given(message.set_beam_load().has_load(), path + ".load");
      return session::SetNodeLoad{
          decode_nodal_load(message.set_beam_load().load(), path + ".load")};
    case proto::Edit::kSetBeamElementLoad:
      require_given(message.set_beam_element_load().has_load(), path + ".load");
      return session::SetElementLoad{
          decode_distributed(message.set_beam_element_load().load(), path + ".load")};
    case proto::Edit::kPushBeamNode:
      require_given(message.push_beam_node().has_load(), path + ".load");
      return session::PushNode{decode_nodal_load(message.push_beam_node().load(), path + ".load")};
    case proto::Edit::kSetGravity:
      return session::SetGravity{decode_vector(message.set_gravity().gravity())};
    case proto::Edit::kUndo:
      return session::Undo{whose(message.undo().anyone())};
    case proto::Edit::kRedo:
      return session::Redo{whose(message.redo().anyone())};
    default:
      throw invalid(path, "this is no edit of structures of beams, and the session is of one");
  }
}

}  // namespace

std::vector<session::BeamEdit> decode_beam_edits(const proto::EditRequest& request,
                                                 const std::vector<beams::BeamNode>& nodes) {
  if (request.edits_size() == 0) throw invalid("edits", "a request needs at least one edit");
  std::vector<session::BeamEdit> edits;
  edits.reserve(static_cast<std::size_t>(request.edits_size()));
  for (int i = 0; i < request.edits_size(); ++i)
    edits.push_back(decode_beam_edit(request.edits(i), fmt::format("edits[{}]", i), nodes));
  return edits;
}

proto::EditResponse encode_beam_receipt(const session::EditReceipt& receipt) {
  proto::EditResponse response = begin_response(receipt);
  for (std::size_t i = 0; i < receipt.constraint_ids.size(); ++i) {
    response.add_target_ids(0);
    response.add_constraint_ids(0);
    response.add_keyframe_ids(0);
  }
  return response;
}

}  // namespace limber::server
