#include "engine/session/linkages/condition_rules.h"

#include <fmt/format.h>

#include <utility>

#include "engine/base/error.h"
#include "engine/rods/linkage/edge_counts.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::session {
namespace {

// As a share of the drawn lengths: the search range for rest lengths of least stress.
constexpr double kShortest = 0.1;
constexpr double kLongest = 10;

std::vector<scene::Issue> check_range(const char* field, const Eigen::VectorXd& requested,
                                      const Eigen::VectorXd& drawn) {
  for (Eigen::Index i = 0; i < requested.size(); ++i) {
    if (requested[i] >= kShortest * drawn[i] && requested[i] <= kLongest * drawn[i]) continue;
    return {{scene::Issue::Severity::kError, fmt::format("{}[{}]", field, i),
             fmt::format("{:g} is not between a tenth and ten times of what is drawn, {:g}",
                         requested[i], drawn[i]),
             ErrorCode::kOutOfRange}};
  }
  return {};
}

}  // namespace

ConditionRules::ConditionRules(rods::LinkageGraph graph, int edges_per_segment, double length_unit)
    : graph_(std::move(graph)),
      variables_(graph_, rods::edges_by_length(graph_, edges_per_segment)),
      drawn_(rods::drawn_lengths(graph_)),
      lengths_(graph_, variables_, drawn_),
      edges_(graph_, variables_),
      drawn_edges_(edges_.listed(lengths_.apply(drawn_))),
      reach_(graph_),
      places_(graph_, length_unit) {}

std::vector<scene::Issue> ConditionRules::check(const scene::LinkageConditions& conditions) const {
  const Eigen::VectorXd& requested = conditions.segment_lengths;
  const Eigen::VectorXd& edges = conditions.edge_lengths;
  const auto refuse = [](const std::string& field, const std::string& message, ErrorCode code) {
    return std::vector<scene::Issue>{{scene::Issue::Severity::kError, field, message, code}};
  };
  if (edges.size() > 0 && edges.size() != edges_.size()) {
    return refuse("edge_lengths",
                  fmt::format("{} lengths for {} edges", edges.size(), edges_.size()),
                  ErrorCode::kInvalidArgument);
  }
  if (conditions.mean_angle && graph_.mixed_angles) {
    return refuse(
        "mean_angle",
        "a mean opening angle has no meaning in this linkage: its rods are no two families "
        "that cross, so that what opens one joint closes the next (a weave of three "
        "families, for instance). Set the angles of single joints, or leave them free",
        ErrorCode::kInvalidArgument);
  }
  std::vector<scene::Issue> far = places_.check(conditions);
  if (far.empty()) far = check_range("segment_lengths", requested, drawn_);
  if (far.empty()) far = check_range("edge_lengths", edges, drawn_edges_);
  if (far.empty()) {
    const Eigen::VectorXd& scales = conditions.section_scales;
    far = check_range("section_scales", scales, Eigen::VectorXd::Ones(scales.size()));
  }
  if (!far.empty()) return far;
  if (requested.size() > 0) {
    try {
      (void)lengths_.apply(requested);
    } catch (const Error& error) {
      return refuse("segment_" + error.field(), error.what(), error.code());
    }
  }
  return reach_.check(conditions, edges.size() > 0 ? edges_.segment_lengths(edges) : requested);
}

std::vector<scene::Issue> ConditionRules::check_drawn(
    const scene::LinkageConditions& conditions) const {
  std::vector<scene::Issue> issues = check(conditions);
  if (!issues.empty()) return issues;
  Eigen::Matrix3Xd places(3, graph_.joints.size());
  for (std::size_t j = 0; j < graph_.joints.size(); ++j)
    places.col(static_cast<Eigen::Index>(j)) = graph_.joints[j].position;
  const Eigen::VectorXd& edges = conditions.edge_lengths;
  return reach_.check(conditions,
                      edges.size() > 0 ? edges_.segment_lengths(edges) : conditions.segment_lengths,
                      places);
}

void ConditionRules::check_shape(const rods::StateNumbers& shape) const {
  rods::validate(shape, graph_, variables_);
  for (Eigen::Index j = 0; j < shape.positions.cols(); ++j) {
    if (!places_.is_far(shape.positions.col(j))) continue;
    throw Error(ErrorCode::kOutOfRange, "positions",
                fmt::format("joint {} is farther than {:.0e} lengths of the linkage from where it "
                            "is drawn",
                            j, PlaceReach::kFarthest));
  }
}

std::size_t ConditionRules::answer_bytes() const {
  constexpr std::size_t kStates = 2;  // where it failed, that and the last that was reached
  std::size_t vertices = 0;
  for (int s = 0; s < variables_.segments(); ++s)
    vertices += static_cast<std::size_t>(variables_.edges(s)) + 1;
  const std::size_t sizes = 2 * graph_.segments.size() + static_cast<std::size_t>(edges_.size());
  return kStates *
         (1024 + vertices * rods::LinkageState::kFields * sizeof(double) +
          graph_.joints.size() * sizeof(rods::JointState<double>) + sizes * sizeof(double));
}

}  // namespace limber::session
