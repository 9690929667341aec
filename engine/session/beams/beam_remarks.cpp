#include "engine/session/beams/beam_remarks.h"

#include <fmt/format.h>

#include <algorithm>

namespace limber::session {
namespace {

constexpr auto kWarning = scene::Issue::Severity::kWarning;
constexpr std::size_t kMostNamed = 5;

/// "node 7", "nodes 7, 8, 9", "nodes 7, 8, 9, 10, 11 and 12 more".
std::string names_of(const std::vector<std::size_t>& nodes) {
  const std::size_t named = std::min(nodes.size(), kMostNamed);
  std::string text = nodes.size() == 1 ? "node " : "nodes ";
  text += fmt::format("{}", fmt::join(nodes.begin(), nodes.begin() + std::ptrdiff_t(named), ", "));
  if (nodes.size() > named) text += fmt::format(" and {} more", nodes.size() - named);
  return text;
}

void remark_unused_nodes(const beams::BeamModel& model, std::vector<scene::Issue>& remarks) {
  const std::vector<char> used = used_nodes(model);
  std::vector<std::size_t> unused;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] == 0) unused.push_back(i);
  }
  if (unused.empty()) return;
  remarks.push_back({kWarning, "nodes",
                     fmt::format("no element uses {}: left out; the others keep their numbers",
                                 names_of(unused))});
}

}  // namespace

std::vector<scene::Issue> beam_remarks(const beams::BeamModel& model) {
  std::vector<scene::Issue> remarks;
  remark_unused_nodes(model, remarks);
  const bool has_weight =
      std::any_of(model.elements.begin(), model.elements.end(), [&](const beams::BeamElement& e) {
        return model.sections[static_cast<std::size_t>(e.section)].mass_per_length > 0;
      });
  if (!has_weight && !model.gravity.isZero(0))
    remarks.push_back(
        {kWarning, "gravity", "gravity has no effect: no section of a beam has a density"});
  return remarks;
}

}  // namespace limber::session
