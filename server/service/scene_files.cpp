#include "server/service/scene_files.h"

#include "engine/scene/point_cache.h"
#include "engine/scene/samples.h"

namespace limber::server {
namespace {

proto::Issue error_issue(const std::string& field, const std::string& message) {
  proto::Issue issue;
  issue.set_severity(proto::Issue::SEVERITY_ERROR);
  issue.set_field(field);
  issue.set_message(message);
  return issue;
}

}  // namespace

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
    for (const auto& issue : scene::validate(decoded.scene))
      issues.push_back(encode_issue(issue, prefix));
  } catch (const Refusal& fault) {  // what cannot even be read is an issue too
    issues.push_back(error_issue(fault.field(), fault.what()));
  } catch (const Error& fault) {
    issues.push_back(error_issue(fault.field(), fault.what()));
  }
  return issues;
}

}  // namespace limber::server
