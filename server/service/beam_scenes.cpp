#include "server/service/beam_scenes.h"

#include <algorithm>
#include <utility>

#include "engine/scene/formats/edge_formats.h"
#include "engine/session/beams/beam_samples.h"
#include "server/codec/faults.h"
#include "server/service/memory_estimate.h"

namespace limber::server {
namespace {

constexpr int kShapes = 256;  // that a session keeps of the ways to its results

/// Readers name files and lines in their messages; the field is where the client gave the lines.
template <class Read>
scene::EdgeMesh read_at(const std::string& field, const Read& read) {
  try {
    return read();
  } catch (const Error& error) {
    throw Error(error.code(), field, error.what());
  }
}

}  // namespace

bool is_beam_sample(const std::string& name) {
  const auto& names = session::beam_sample_names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

proto::Scene beam_sample_scene(const std::string& name) {
  session::BeamSample sample = session::make_beam_sample(name);
  proto::BeamSection section;
  section.mutable_tube()->set_outer_radius(sample.outer_radius);
  section.mutable_tube()->set_inner_radius(sample.inner_radius);
  section.set_young(sample.material.young);
  section.set_poisson(sample.material.poisson);
  section.set_density(sample.material.density);
  section.set_yield_stress(sample.material.yield_stress);
  return encode_beam_scene({name, std::move(sample.model), {section}, std::nullopt});
}

EdgeLoader edge_loader(
    std::function<std::filesystem::path(const std::string& path, const std::string& field)>
        resolve) {
  return [resolve = std::move(resolve)](const proto::LineSource& source, const std::string& field) {
    switch (source.source_case()) {
      case proto::LineSource::kPath: {
        const auto file = resolve(source.path(), field + ".path");
        return read_at(field + ".path", [&] { return scene::read_edge_mesh_file(file); });
      }
      case proto::LineSource::kFile:
        return read_at(field + ".file", [&] {
          return scene::read_edge_mesh(source.file().name(), source.file().content());
        });
      default:
        throw invalid(field, "lines of beams are a path, a file or arrays");
    }
  };
}

void demand_beam_memory(const beams::BeamModel& model, std::uint64_t session_bytes) {
  const std::uint64_t bytes = estimate_beam_bytes(model, kShapes);
  if (session_bytes > 0 && bytes > session_bytes)
    throw limit_exceeded("scene", "estimated bytes of the session", session_bytes, bytes);
}

std::vector<proto::Issue> beam_issues(const proto::Scene& message, const std::string& prefix,
                                      const EdgeLoader& load_edges, std::uint64_t session_bytes) {
  Faults faults(Faults::Mode::kCollect);
  faults.try_to([&] {
    demand_beam_memory(decode_beam_scene(message, prefix, load_edges).model, session_bytes);
  });
  std::vector<proto::Issue> issues;
  for (const auto& fault : faults.found()) {
    auto& issue = issues.emplace_back();
    issue.set_severity(proto::Issue::SEVERITY_ERROR);
    issue.set_field(fault.field);
    issue.set_message(fault.message);
    issue.set_code(fault.code);
  }
  return issues;
}

}  // namespace limber::server
