#include "server/service/scene_files.h"

#include <set>

#include "engine/scene/formats/point_cache.h"
#include "engine/scene/samples/samples.h"
#include "engine/session/document.h"
#include "server/codec/field_paths.h"
#include "server/service/memory_estimate.h"

namespace limber::server {
namespace {

proto::Issue error_issue(proto::ErrorCode code, const std::string& field,
                         const std::string& message) {
  proto::Issue issue;
  issue.set_severity(proto::Issue::SEVERITY_ERROR);
  issue.set_field(field);
  issue.set_message(message);
  issue.set_code(code);
  return issue;
}

/// "constraints[3]" of "constraints[3].nodes[1]": what one complaint about is enough.
std::string head_of(const std::string& field) { return field.substr(0, field.find('.')); }

bool is_error(const scene::Issue& issue) {
  return issue.severity == scene::Issue::Severity::kError;
}

}  // namespace

std::vector<scene::Issue> all_issues(const scene::Scene& scene) {
  auto issues = scene::validate(scene);
  std::set<std::string> complained;
  for (const auto& issue : issues) {
    if (is_error(issue)) complained.insert(head_of(issue.field));
  }
  // Too few frames for the ends: said of the frames already.
  if (complained.contains("frames")) complained.insert("last_end");
  for (auto& issue : session::document_issues(scene)) {
    if (!complained.contains(head_of(issue.field))) issues.push_back(std::move(issue));
  }
  return issues;
}

void demand_memory(const scene::Scene& scene, const std::string& prefix,
                   const SceneLimits& limits) {
  const std::uint64_t bytes = estimate_session_bytes(scene);
  if (limits.session_bytes == 0 || bytes <= limits.session_bytes) return;
  const std::string field = prefix.empty() ? "" : prefix.substr(0, prefix.size() - 1);
  throw limit_exceeded(field, "estimated bytes of the session", limits.session_bytes, bytes);
}

proto::Scene sample_scene(const std::string& name) {
  proto::Scene message = encode_scene(scene::make_sample(name));
  message.mutable_mesh()->set_sample(name);
  return message;
}

Eigen::MatrixXd read_pc2_positions(const std::string& bytes, const std::string& field) {
  return scene::read_pc2(field, bytes).positions.cast<double>();
}

std::vector<proto::Issue> scene_issues(const proto::Scene& scene, const std::string& prefix,
                                       const SceneLimits& limits, const MeshLoader& load_mesh) {
  std::vector<proto::Issue> issues;
  try {
    const DecodedScene decoded = decode_scene(scene, prefix, limits, load_mesh, read_pc2_positions);
    for (const auto& text : decoded.mesh_warnings)
      issues.push_back(encode_warning(prefix + "mesh", text));
    for (auto issue : all_issues(decoded.scene)) {
      issue.field = field_in(scene, decoded.scene, issue.field);
      issues.push_back(encode_issue(issue, prefix));
    }
    demand_memory(decoded.scene, prefix, limits);
  } catch (const Refusal& fault) {  // what cannot even be read is an issue too
    issues.push_back(error_issue(fault.code(), fault.field(), fault.what()));
  } catch (const Error& fault) {
    issues.push_back(error_issue(to_proto(fault.code()), fault.field(), fault.what()));
  }
  return issues;
}

}  // namespace limber::server
