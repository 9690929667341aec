#include "server/kinds/linkages/scenes.h"

#include <algorithm>
#include <utility>

#include "engine/scene/formats/line_formats.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/edge_choice.h"
#include "engine/session/linkages/remarks.h"
#include "server/wire/faults.h"
#include "server/wire/fields.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

/// Reduced variables, Hessian, its factor with room for fill, a path of shapes: a guess on the safe
/// side.
constexpr std::uint64_t kBytesPerEdge = 24'000, kKeptBytesPerEdge = 9'000;
constexpr int kLeastEdges = 3;  // of a segment

}  // namespace

LineLoader line_loader(PathResolver resolve) {
  return [resolve = std::move(resolve)](const proto::LineSource& source, const std::string& field) {
    auto lines = read_lines(
        source, field, resolve, [](const auto& path) { return scene::read_line_mesh_file(path); },
        [](const auto& name, const auto& content) { return scene::read_line_mesh(name, content); });
    if (lines) return std::move(*lines);
    return read_at(field + ".sample",
                   [&] { return scene::make_linkage_sample(source.sample()).lines; });
  };
}

proto::Scene linkage_sample_scene(const std::string& name) {
  proto::Scene message = encode_linkage(scene::make_linkage_sample(name));
  message.mutable_linkage()->mutable_lines()->set_sample(name);
  return message;
}

int most_chosen_edges(const scene::Linkage& linkage, std::uint64_t session_bytes) {
  if (session_bytes == 0 || linkage.lines.edge_count() == 0) return session::kMostChosenEdges;
  const std::uint64_t bytes =
      static_cast<std::uint64_t>(linkage.lines.edge_count()) * kBytesPerEdge;
  return static_cast<int>(
      std::clamp<std::uint64_t>(session_bytes / bytes, kLeastEdges, session::kMostChosenEdges));
}

SessionMemory estimate_linkage_memory(const scene::Linkage& linkage) {
  const int least = linkage.edges_per_segment == 0 ? kLeastEdges : linkage.edges_per_segment;
  const auto edges =
      static_cast<std::uint64_t>(linkage.lines.edge_count()) * static_cast<std::uint64_t>(least);
  return {edges * kBytesPerEdge, edges * kKeptBytesPerEdge};
}

session::LinkageCheck check_linkage(const scene::Linkage& linkage, std::uint64_t session_bytes) {
  const std::uint64_t bytes = estimate_linkage_memory(linkage).building;
  if (session_bytes > 0 && bytes > session_bytes)
    throw limit_exceeded("scene", "estimated bytes of the session", session_bytes, bytes);
  return session::check_linkage(linkage);
}

std::vector<proto::Issue> linkage_issues(const proto::Scene& message, const std::string& prefix,
                                         const LineLoader& load_lines,
                                         std::uint64_t session_bytes) {
  Faults faults(Faults::Mode::kCollect);
  std::vector<proto::Issue> issues;
  faults.try_to([&] {
    const scene::Linkage linkage = decode_linkage(message, prefix, load_lines);
    const auto check = check_linkage(linkage, session_bytes);
    faults.try_each(prefix + "linkage", static_cast<int>(check.issues.size()), [&](int i) {
      const scene::Issue& issue = check.issues[static_cast<std::size_t>(i)];
      throw Error(issue.code, prefix + linkage_field_in(message, issue.field), issue.message);
    });
    if (!check.issues.empty()) return;
    for (scene::Issue issue : session::linkage_remarks(linkage)) {
      issue.field = linkage_field_in(message, issue.field);
      issues.push_back(encode_issue(issue, prefix));
    }
  });
  for (const auto& fault : faults.found()) issues.push_back(encode_fault(fault));
  return issues;
}

}  // namespace limber::server
