#include "server/kinds/bodies/scenes.h"

#include <algorithm>
#include <set>
#include <utility>

#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/document.h"
#include "server/kinds/bodies/field_paths.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

bool is_of_mesh(const std::string& prefix, const std::string& field) {
  return field == prefix + "mesh" || field.starts_with(prefix + "mesh.");
}

bool is_error(const scene::Issue& issue) {
  return issue.severity == scene::Issue::Severity::kError;
}

void warn_of_file(const DecodedScene& decoded, const std::string& prefix,
                  std::vector<proto::Issue>& issues) {
  for (const auto& text : decoded.mesh_warnings)
    issues.push_back(encode_warning(prefix + "mesh", text));
  if (!decoded.material_warning.empty())
    issues.push_back(encode_warning(prefix + "material", decoded.material_warning));
}

}  // namespace

std::vector<scene::Issue> all_issues(const scene::Scene& scene) {
  auto issues = scene::validate(scene);
  std::set<std::string> complained;
  for (const auto& issue : issues) {
    if (is_error(issue)) complained.insert(issue.field);
  }
  // Too few frames for the ends: reported of the frames already.
  if (complained.contains("frames")) complained.insert("last_end");
  for (auto& issue : session::document_issues(scene)) {
    if (!complained.contains(issue.field)) issues.push_back(std::move(issue));
  }
  return issues;
}

void demand_memory(const scene::Scene& scene, const SceneLimits& limits) {
  const std::uint64_t bytes = estimate_session_bytes(scene);
  if (limits.session_bytes == 0 || bytes <= limits.session_bytes) return;
  throw limit_exceeded("scene", "estimated bytes of the session", limits.session_bytes, bytes);
}

proto::Scene sample_scene(const std::string& name) {
  proto::Scene message = encode_scene(scene::make_sample(name));
  message.mutable_mesh()->set_sample(name);
  return message;
}

std::vector<proto::Issue> remarks(const proto::Scene& message, const DecodedScene& decoded,
                                  const std::string& prefix) {
  std::vector<proto::Issue> warnings;
  warn_of_file(decoded, prefix, warnings);
  for (auto issue : all_issues(decoded.scene)) {
    issue.field = body_field_in(message, decoded.scene, issue.field);
    if (is_error(issue)) throw Error(issue.code, prefix + issue.field, issue.message);
    warnings.push_back(encode_issue(issue, prefix));
  }
  return warnings;
}

std::vector<proto::Issue> scene_issues(const proto::Scene& scene, const std::string& prefix,
                                       const SceneLimits& limits, const SceneReaders& readers) {
  Faults faults(Faults::Mode::kCollect);
  const DecodedScene decoded = decode_scene(scene, prefix, limits, readers, faults);
  std::vector<proto::Issue> issues;
  std::set<std::string> complained;  // one complaint about a field is enough
  for (const auto& fault : faults.found()) {
    if (complained.insert(fault.field).second) issues.push_back(encode_fault(fault));
  }
  const bool no_mesh =
      std::any_of(complained.begin(), complained.end(),
                  [&](const std::string& field) { return is_of_mesh(prefix, field); });
  warn_of_file(decoded, prefix, issues);
  std::set<std::pair<std::string, std::string>> reported;
  for (auto issue : all_issues(decoded.scene)) {
    issue.field = body_field_in(scene, decoded.scene, issue.field);
    proto::Issue message = encode_issue(issue, prefix);
    if (complained.contains(message.field()) || (no_mesh && is_of_mesh(prefix, message.field())))
      continue;
    if (reported.emplace(message.field(), message.message()).second)
      issues.push_back(std::move(message));
  }
  if (!faults.found().empty()) return issues;  // items that were not read have no size
  Faults memory(Faults::Mode::kCollect);
  memory.try_to([&] { demand_memory(decoded.scene, limits); });
  for (const auto& fault : memory.found()) issues.push_back(encode_fault(fault));
  return issues;
}

}  // namespace limber::server
