#include "engine/session/linkage/condition_rules.h"

#include <fmt/format.h>

#include <utility>

#include "engine/base/error.h"

namespace limber::session {
namespace {

// Of a segment's drawn length: the range that rest lengths of least stress are looked for in.
constexpr double kShortest = 0.1;
constexpr double kLongest = 10;

}  // namespace

ConditionRules::ConditionRules(rods::LinkageGraph graph, int edges_per_segment)
    : graph_(std::move(graph)),
      variables_(graph_, edges_per_segment),
      drawn_(rods::drawn_lengths(graph_)),
      lengths_(graph_, variables_, drawn_),
      reach_(graph_) {}

std::vector<scene::Issue> ConditionRules::check(const scene::LinkageConditions& conditions) const {
  const Eigen::VectorXd& wanted = conditions.segment_lengths;
  const auto refuse = [](const std::string& field, const std::string& message, ErrorCode code) {
    return std::vector<scene::Issue>{{scene::Issue::Severity::kError, field, message, code}};
  };
  for (Eigen::Index s = 0; s < wanted.size(); ++s) {
    if (wanted[s] >= kShortest * drawn_[s] && wanted[s] <= kLongest * drawn_[s]) continue;
    return refuse(fmt::format("segment_lengths[{}]", s),
                  fmt::format("{:g} is not between a tenth and ten times of what is drawn, {:g}",
                              wanted[s], drawn_[s]),
                  ErrorCode::kOutOfRange);
  }
  if (wanted.size() > 0) {
    try {
      (void)lengths_.apply(wanted);
    } catch (const Error& error) {
      return refuse("segment_" + error.field(), error.what(), error.code());
    }
  }
  return reach_.check(conditions);
}

}  // namespace limber::session
