#include "server/kinds/bodies/edit.h"

#include <fmt/format.h>

#include <memory>

#include "server/kinds/bodies/keyframe.h"
#include "server/wire/edits.h"

namespace limber::server {
namespace {

session::BodyEdit decode_move(const proto::MoveConstraint& message, const std::string& field) {
  if (!message.has_target()) throw invalid(field + ".target", "where to move it is missing");
  return session::MoveConstraint{
      message.id(), {message.target().x(), message.target().y(), message.target().z()}};
}

/// In a scene an end that is not given has a default. In an edit, an omitted end would be changed
/// to that default without a request.
scene::End decode_given_end(proto::EndCondition end, const std::string& field) {
  if (end == proto::END_CONDITION_UNSPECIFIED)
    throw invalid(field, "missing: an edit of the ends names both");
  return decode_end(end);
}

session::BodyEdit decode_set_ends(const proto::SetEnds& message, const std::string& field) {
  return session::SetEnds{decode_given_end(message.first_end(), field + ".first_end"),
                          decode_given_end(message.last_end(), field + ".last_end")};
}

struct Poses {
  const scene::Scene& scene;
  const MeshLoader& load_mesh;
};

session::BodyEdit decode_set_pins(const proto::SetPins& message, const std::string& field,
                                  const scene::Scene& scene) {
  if (!message.has_pins()) return session::SetPins{};
  return session::SetPins{std::make_shared<const Eigen::MatrixXd>(
      decode_pin_paths(message.pins(), field + ".pins", scene))};
}

session::BodyEdit decode_add_keyframe(const proto::AddKeyframe& message, const std::string& field,
                                      const Poses& poses) {
  if (!message.has_keyframe()) throw invalid(field + ".keyframe", "missing");
  Faults faults(Faults::Mode::kThrow);
  return session::AddKeyframe{decode_keyframe(message.keyframe(), field + ".keyframe",
                                              poses.scene.mesh.nodes, poses.load_mesh, faults)};
}

session::BodyEdit decode_body_edit(const proto::Edit& message, const std::string& field,
                                   const Poses& poses) {
  switch (message.edit_case()) {
    case proto::Edit::kAdd:
      if (!message.add().has_constraint()) throw invalid(field + ".add.constraint", "missing");
      return session::AddConstraint{
          decode_constraint(message.add().constraint(), field + ".add.constraint")};
    case proto::Edit::kMove:
      return decode_move(message.move(), field + ".move");
    case proto::Edit::kReplace:
      if (!message.replace().has_constraint())
        throw invalid(field + ".replace.constraint", "missing");
      return session::ReplaceConstraint{
          decode_constraint(message.replace().constraint(), field + ".replace.constraint")};
    case proto::Edit::kRemove:
      return session::RemoveConstraint{message.remove().id()};
    case proto::Edit::kSetEnds:
      return decode_set_ends(message.set_ends(), field + ".set_ends");
    case proto::Edit::kSetDynamics:
      return session::SetDynamics{decode_dynamics(message.set_dynamics())};
    case proto::Edit::kSetMaterial:
      if (message.set_material().variables() == proto::MATERIAL_VARIABLES_UNSPECIFIED)
        throw invalid(field + ".set_material.variables", "what to optimise is missing");
      return session::SetMaterialVariables{decode_variables(message.set_material().variables())};
    case proto::Edit::kResetMaterial:
      return session::ResetMaterial{};
    case proto::Edit::kAddKeyframe:
      return decode_add_keyframe(message.add_keyframe(), field + ".add_keyframe", poses);
    case proto::Edit::kMoveKeyframe:
      return decode_move_keyframe(message.move_keyframe(), field + ".move_keyframe");
    case proto::Edit::kRemoveKeyframe:
      return session::RemoveKeyframe{message.remove_keyframe().id()};
    case proto::Edit::kSetPins:
      return decode_set_pins(message.set_pins(), field + ".set_pins", poses.scene);
    case proto::Edit::kUndo:
      return session::Undo{whose(message.undo().anyone())};
    case proto::Edit::kRedo:
      return session::Redo{whose(message.redo().anyone())};
    case proto::Edit::EDIT_NOT_SET:
      break;
    default:
      throw invalid(
          fmt::format("{}.{}", field,
                      proto::Edit::descriptor()->FindFieldByNumber(message.edit_case())->name()),
          "this is no edit of elastic bodies, and the session is of one");
  }
  throw invalid(field, "an edit without content");
}

}  // namespace

std::vector<session::BodyEdit> decode_edits(const proto::EditRequest& request,
                                            const scene::Scene& scene,
                                            const MeshLoader& load_mesh) {
  if (request.edits_size() == 0) throw invalid("edits", "a request needs at least one edit");
  std::vector<session::BodyEdit> edits;
  edits.reserve(static_cast<std::size_t>(request.edits_size()));
  for (int i = 0; i < request.edits_size(); ++i)
    edits.push_back(
        decode_body_edit(request.edits(i), fmt::format("edits[{}]", i), {scene, load_mesh}));
  return edits;
}

proto::EditResponse encode_receipt(const session::EditReceipt& receipt) {
  proto::EditResponse response = begin_response(receipt);
  for (const auto id : receipt.constraint_ids) response.add_constraint_ids(id);
  for (const auto id : receipt.keyframe_ids) response.add_keyframe_ids(id);
  return response;
}

}  // namespace limber::server
