#include "engine/rods/linkage/state_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

/// Squares of larger numbers overflow.
constexpr double kLargestNumber = 1e100;
/// Tolerance of unit vectors and right angles: numbers may be float32, or rounded by hand.
constexpr double kSlack = 1e-3;
/// Share of the farthest coordinate: shorter vectors have no direction.
constexpr double kShortest = 1e-12;

[[noreturn]] void refuse_state(const char* field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

void demand_numbers(const Eigen::Ref<const Eigen::MatrixXd>& numbers, Eigen::Index count,
                    const char* field, const char* what) {
  if (numbers.cols() != count)
    refuse_state(field,
                 fmt::format("has {} rows, the linkage {} {}; leave the shape out to open as drawn",
                             numbers.cols(), count, what));
  for (Eigen::Index i = 0; i < count; ++i) {
    if ((numbers.col(i).array().abs() <= kLargestNumber).all()) continue;  // NaN is not
    refuse_state(field, fmt::format("row {} is not finite, or beyond {:g}", i, kLargestNumber));
  }
}

void demand_unit(const Eigen::Matrix3Xd& vectors, const char* field) {
  for (Eigen::Index i = 0; i < vectors.cols(); ++i) {
    const double norm = vectors.col(i).norm();
    if (std::abs(norm - 1) > kSlack)
      refuse_state(field, fmt::format("row {} is of length {:g}, must be 1", i, norm));
  }
}

void demand_joints(const StateNumbers& numbers, const LinkageGraph& graph) {
  const auto joints = static_cast<Eigen::Index>(graph.joints.size());
  demand_numbers(numbers.positions, joints, "positions", "joints");
  demand_numbers(numbers.normals, joints, "normals", "joints");
  demand_numbers(numbers.bisectors, joints, "bisectors", "joints");
  demand_numbers(numbers.opening_angles.transpose(), joints, "opening_angles", "joints");
  demand_numbers(numbers.lengths, joints, "lengths", "joints");
  demand_unit(numbers.normals, "normals");
  demand_unit(numbers.bisectors, "bisectors");
  for (Eigen::Index j = 0; j < joints; ++j) {
    if (std::abs(numbers.normals.col(j).dot(numbers.bisectors.col(j))) > kSlack)
      refuse_state("bisectors", fmt::format("row {} is not across the normal of joint {}", j, j));
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const auto& segments = graph.joints[static_cast<std::size_t>(j)].segments[rod];
      const bool is_there = segments[0] >= 0 || segments[1] >= 0;
      if (is_there && !(numbers.lengths(rod, j) > 0))
        refuse_state("lengths",
                     fmt::format("row {} has {:g}, must be > 0", j, numbers.lengths(rod, j)));
    }
  }
}

/// Vertices of one segment, those of its joints among them; numbers of its own begin at `first`.
std::vector<Eigen::Vector3d> chain_of(const StateNumbers& numbers, const Segment& segment,
                                      int edges, Eigen::Index first) {
  std::vector<Eigen::Vector3d> chain;
  const auto terminal = [&](End end) {
    const TerminalEdge<double> edge =
        terminal_edge(terminal_edge_source(joint_of(numbers, segment.joints[end]),
                                           segment.rods[end], segment.signs[end]),
                      JointIncrement<double>(JointIncrement<double>::Zero()));
    chain.push_back(edge.first);
    chain.push_back(edge.second);
  };
  if (segment.joints[kStart] >= 0) terminal(kStart);
  const int own_end = edges + 1 - (segment.joints[kFinish] >= 0 ? 2 : 0);
  while (static_cast<int>(chain.size()) < own_end)
    chain.emplace_back(numbers.vertices.col(first++));
  if (segment.joints[kFinish] >= 0) terminal(kFinish);
  return chain;
}

}  // namespace

StateSizes state_sizes(const ReducedVariables& variables) {
  StateSizes counts;
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    for (int i = 0; i <= edges; ++i) counts.vertices += variables.position(s, i) >= 0 ? 1 : 0;
    for (int e = 0; e < edges; ++e) counts.directors += variables.angle(s, e) >= 0 ? 1 : 0;
    counts.twists += edges - 1;
  }
  return counts;
}

JointState<double> joint_of(const StateNumbers& numbers, Eigen::Index j) {
  const Eigen::Vector3d normal = numbers.normals.col(j).normalized();
  const Eigen::Vector3d bisector = numbers.bisectors.col(j);
  return {numbers.positions.col(j),
          normal,
          (bisector - bisector.dot(normal) * normal).normalized(),
          numbers.opening_angles[j],
          {numbers.lengths(kRodA, j), numbers.lengths(kRodB, j)}};
}

void validate(const StateNumbers& numbers, const LinkageGraph& graph,
              const ReducedVariables& variables) {
  demand_joints(numbers, graph);
  const StateSizes counts = state_sizes(variables);
  demand_numbers(numbers.vertices, counts.vertices, "vertices", "vertices that are no joint's");
  demand_numbers(numbers.directors, counts.directors, "directors", "edges that are no joint's");
  demand_numbers(numbers.twists.transpose(), counts.twists, "twists", "vertices within segments");
  demand_unit(numbers.directors, "directors");
  Eigen::Index vertex = 0, director = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    const std::vector<Eigen::Vector3d> chain =
        chain_of(numbers, graph.segments[static_cast<std::size_t>(s)], edges, vertex);
    for (int i = 0; i <= edges; ++i) vertex += variables.position(s, i) >= 0 ? 1 : 0;
    for (int e = 0; e < edges; ++e) {
      const Eigen::Vector3d &from = chain[static_cast<std::size_t>(e)],
                            &to = chain[static_cast<std::size_t>(e) + 1];
      const double length = (to - from).norm();
      if (!(length > kShortest * std::max(from.cwiseAbs().maxCoeff(), to.cwiseAbs().maxCoeff())))
        refuse_state("vertices", fmt::format("edge {} of segment {} has no length", e, s));
      if (variables.angle(s, e) < 0) continue;
      const double along = numbers.directors.col(director).dot(to - from) / length;
      if (std::abs(along) > kSlack) {
        refuse_state(
            "directors",
            fmt::format("row {} is not across edge {} of segment {}: either is of another shape",
                        director, e, s));
      }
      ++director;
    }
  }
}

}  // namespace limber::rods
