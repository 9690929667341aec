#include "engine/session/beams/remarks.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::session {
namespace {

constexpr auto kWarning = scene::Issue::Severity::kWarning;
constexpr std::size_t kMaxNamedNodes = 5;

/// "node 7", "nodes 7, 8, 9", "nodes 7, 8, 9, 10, 11 and 12 more".
std::string names_of(const std::vector<std::size_t>& nodes) {
  const std::size_t named = std::min(nodes.size(), kMaxNamedNodes);
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

/// If the bending stiffnesses of a section differ by less, it needs no normal.
constexpr double kMinBendingDifference = 0.01;
constexpr double kMaxDirectionDifferenceDeg = 5;
constexpr double kMinSectionRotationDeg = 30;

double angle_between_lines_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 / std::numbers::pi;
}

/// Does the direction of axis 3 follow from a rule, and does it matter?
bool has_implied_normal(const beams::BeamModel& model, const beams::BeamElement& e) {
  const beams::BeamSection& s = model.sections[static_cast<std::size_t>(e.section)];
  return e.kind == beams::BeamKind::kBeam && e.normal.isZero(0) &&
         std::abs(s.bending_2 - s.bending_3) >
             kMinBendingDifference * std::max(s.bending_2, s.bending_3);
}

/// Warns of elements that continue each other with sections rotated against each other, e.g. along
/// a member that is nearly vertical. The cause: each element is classified as vertical or not by
/// itself.
void remark_rotated_sections(const beams::BeamModel& model, std::vector<scene::Issue>& remarks) {
  std::vector<std::vector<std::size_t>> elements_of(model.nodes.size());
  for (std::size_t i = 0; i < model.elements.size(); ++i) {
    if (!has_implied_normal(model, model.elements[i])) continue;
    for (const int node : {model.elements[i].start, model.elements[i].finish})
      elements_of[static_cast<std::size_t>(node)].push_back(i);
  }
  std::vector<std::string> pairs;
  double largest_deg = 0;
  for (const auto& at_node : elements_of) {
    for (std::size_t i = 0; i < at_node.size(); ++i) {
      for (std::size_t j = i + 1; j < at_node.size(); ++j) {
        const Eigen::Matrix3d a = drawn_frame(model, static_cast<int>(at_node[i]));
        const Eigen::Matrix3d b = drawn_frame(model, static_cast<int>(at_node[j]));
        if (angle_between_lines_deg(a.col(0), b.col(0)) > kMaxDirectionDifferenceDeg) continue;
        const double rotation_deg = angle_between_lines_deg(a.col(2), b.col(2));
        if (rotation_deg < kMinSectionRotationDeg) continue;
        largest_deg = std::max(largest_deg, rotation_deg);
        pairs.push_back(fmt::format("{} and {}", at_node[i], at_node[j]));
      }
    }
  }
  if (pairs.empty()) return;
  const std::size_t named = std::min(pairs.size(), kMaxNamedNodes);
  std::string names =
      fmt::format("{}", fmt::join(pairs.begin(), pairs.begin() + std::ptrdiff_t(named), ", "));
  if (pairs.size() > named) names += fmt::format(" and {} more pairs", pairs.size() - named);
  remarks.push_back(
      {kWarning, "elements",
       fmt::format("elements {} continue each other, but their sections are rotated against each "
                   "other by up to {:.0f} degrees about the member: set their normals",
                   names, largest_deg)});
}

}  // namespace

std::vector<scene::Issue> beam_remarks(const beams::BeamModel& model) {
  std::vector<scene::Issue> remarks;
  remark_unused_nodes(model, remarks);
  remark_rotated_sections(model, remarks);
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
