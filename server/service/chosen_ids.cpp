#include "server/service/chosen_ids.h"

#include <fmt/format.h>

#include <string>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

std::string message_of(std::uint64_t id) {
  return fmt::format("{} is larger than {} (2^53 - 1); 0 lets the session choose one", id,
                     kLargestChosenId);
}

void demand_small(std::uint64_t id, const std::string& field) {
  if (id > kLargestChosenId) throw invalid(field, message_of(id));
}

/// @param take  called with each id that is too large and its field
template <class Take>
void for_each_too_large(const proto::Scene& scene, const Take& take) {
  const auto look_at = [&](const auto& items, const char* list) {
    for (int i = 0; i < items.size(); ++i) {
      if (const std::uint64_t id = items[i].id(); id > kLargestChosenId)
        take(id, fmt::format("scene.{}[{}].id", list, i));
    }
  };
  look_at(scene.constraints(), "constraints");
  look_at(scene.keyframes(), "keyframes");
  look_at(scene.linkage().conditions().targets(), "linkage.conditions.targets");
}

}  // namespace

void demand_chosen_ids(const proto::EditRequest& request) {
  for (int i = 0; i < request.edits_size(); ++i) {
    const proto::Edit& edit = request.edits(i);
    if (edit.has_add()) {
      demand_small(edit.add().constraint().id(), fmt::format("edits[{}].add.constraint.id", i));
    } else if (edit.has_add_keyframe()) {
      demand_small(edit.add_keyframe().keyframe().id(),
                   fmt::format("edits[{}].add_keyframe.keyframe.id", i));
    } else if (edit.has_add_target()) {
      demand_small(edit.add_target().target().id(),
                   fmt::format("edits[{}].add_target.target.id", i));
    }
  }
}

void demand_chosen_ids(const proto::Scene& scene) {
  for_each_too_large(scene,
                     [](std::uint64_t id, const std::string& field) { demand_small(id, field); });
}

void add_issues_of_ids(const proto::Scene& scene, proto::ValidateSceneResponse& response) {
  for_each_too_large(scene, [&](std::uint64_t id, const std::string& field) {
    auto& issue = *response.add_issues();
    issue.set_severity(proto::Issue::SEVERITY_ERROR);
    issue.set_code(proto::ERROR_CODE_INVALID_ARGUMENT);
    issue.set_field(field);
    issue.set_message(message_of(id));
  });
}

}  // namespace limber::server
