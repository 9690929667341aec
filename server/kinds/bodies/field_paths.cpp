#include "server/kinds/bodies/field_paths.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "server/kinds/bodies/keyframe.h"

namespace limber::server {
namespace {

/// The index in "name[INDEX]...", and what follows the bracket.
struct Indexed {
  int index = 0;
  std::string rest;
};

std::optional<Indexed> indexed(const std::string& field, const std::string& name) {
  const std::string opening = name + "[";
  if (!field.starts_with(opening)) return std::nullopt;
  Indexed found;
  const char* const end = field.data() + field.size();
  const auto [stop, fault] = std::from_chars(field.data() + opening.size(), end, found.index);
  if (fault != std::errc() || stop == end || *stop != ']' || found.index < 0) return std::nullopt;
  found.rest.assign(stop + 1, end);
  return found;
}

const char* target_name(const proto::Constraint& constraint) {
  return constraint.has_position() ? "position" : "displacement";
}

}  // namespace

std::string field_in(const proto::Scene& message, const scene::Scene& scene,
                     const std::string& field) {
  if (const auto at = indexed(field, "constraints");
      at && at->rest == ".target" && at->index < message.constraints_size()) {
    return fmt::format("constraints[{}].{}", at->index,
                       target_name(message.constraints(at->index)));
  }
  if (const auto at = indexed(field, "keyframes");
      at && at->rest == ".pose" && at->index < message.keyframes_size()) {
    return fmt::format("keyframes[{}].{}", at->index, pose_name(message.keyframes(at->index)));
  }
  if (const auto at = indexed(field, "mesh.materials")) {
    const int groups = message.material_groups_size();
    const int group = at->index - (static_cast<int>(scene.mesh.materials.size()) - groups);
    if (group >= 0 && group < groups)
      return fmt::format("material_groups[{}].material{}", group, at->rest);
    if (groups > 0) return "material" + at->rest;  // of the tets that are in no group
  }
  return field;
}

std::string field_in(const proto::EditRequest& message, const std::string& field) {
  const auto at = indexed(field, "edits");
  if (!at || at->index >= message.edits_size()) return field;
  const auto& edit = message.edits(at->index);
  const auto in = [&](const char* kind, const proto::Constraint& constraint) {
    return fmt::format("edits[{}].{}.constraint.{}", at->index, kind, target_name(constraint));
  };
  if (at->rest == ".add.constraint.target") return in("add", edit.add().constraint());
  if (at->rest == ".add_keyframe.keyframe.pose") {
    return fmt::format("edits[{}].add_keyframe.keyframe.{}", at->index,
                       pose_name(edit.add_keyframe().keyframe()));
  }
  if (at->rest == ".replace.constraint.target") return in("replace", edit.replace().constraint());
  return field;
}

}  // namespace limber::server
