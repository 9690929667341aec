#include "server/kinds/beams/scenes.h"

#include <algorithm>
#include <utility>

#include "engine/scene/formats/edge_formats.h"
#include "engine/session/beams/remarks.h"
#include "engine/session/beams/samples.h"
#include "server/kinds/beams/memory_estimate.h"
#include "server/wire/faults.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

constexpr int kShapes = 256;  // that a session keeps of the paths to its results

}  // namespace

SessionMemory estimate_beam_memory(const beams::BeamModel& model) {
  const std::uint64_t bytes = estimate_beam_bytes(model, kShapes);
  return {bytes, bytes / 2};
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

EdgeLoader edge_loader(PathResolver resolve) {
  return [resolve = std::move(resolve)](const proto::LineSource& source, const std::string& field) {
    auto lines = read_lines(
        source, field, resolve, [](const auto& path) { return scene::read_edge_mesh_file(path); },
        [](const auto& name, const auto& content) { return scene::read_edge_mesh(name, content); });
    if (!lines) throw invalid(field, "lines of beams are a path, a file or arrays");
    return std::move(*lines);
  };
}

beams::BeamDiscretisation demand_beam_memory(const DecodedBeams& scene,
                                             std::uint64_t session_bytes) {
  beams::BeamDiscretisation discretisation = scene.discretisation;
  if (session_bytes == 0) return discretisation;
  const int begun = discretisation.first(scene.model).elements();
  const auto bytes_with = [&](int elements) {
    return estimate_cut_beam_bytes(scene.model, elements, kShapes);
  };
  if (const std::uint64_t bytes = bytes_with(begun); bytes > session_bytes)
    throw limit_exceeded("scene", "estimated bytes of the session", session_bytes, bytes);
  int& most = discretisation.max_elements;
  while (most > begun && bytes_with(most) > session_bytes) most -= (most + 7) / 8;
  most = std::max({most, begun, 1});
  return discretisation;
}

std::vector<proto::Issue> beam_issues(const proto::Scene& message, const std::string& prefix,
                                      const EdgeLoader& load_edges, std::uint64_t session_bytes) {
  Faults faults(Faults::Mode::kCollect);
  std::vector<proto::Issue> issues;
  faults.try_to([&] {
    const DecodedBeams scene = decode_beam_scene(message, prefix, load_edges);
    (void)demand_beam_memory(scene, session_bytes);
    for (const auto& remark : session::beam_remarks(scene.model))
      issues.push_back(encode_issue(remark, prefix + "beams.structure."));
  });
  for (const auto& fault : faults.found()) issues.push_back(encode_fault(fault));
  return issues;
}

}  // namespace limber::server
