#include "engine/session/linkages/refinement.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "engine/session/linkages/edge_choice.h"
#include "engine/session/linkages/session.h"

namespace limber::session {
namespace {

constexpr int kRounds = 3;
/// Shapes farther apart than so many times the estimated error of the given edges belong to other
/// equilibria. The same holds beyond a share of the size, whatever the estimate.
constexpr double kSameBranch = 3, kMostShare = 0.1;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// A segment's vertices and how far each is along it.
struct Line {
  Eigen::Matrix3Xd vertices;
  Eigen::VectorXd along;
  double from = 0, to = 0;  // its joints, at the middle of the edge that ends there, or free ends

  Line(const double* numbers, int edges, int first_joint, int last_joint)
      : vertices(Eigen::Map<const Eigen::Matrix3Xd>(numbers, 3, edges + 1)),
        along(Eigen::VectorXd::Zero(edges + 1)) {
    for (Eigen::Index v = 0; v < edges; ++v)
      along[v + 1] = along[v] + (vertices.col(v + 1) - vertices.col(v)).norm();
    from = first_joint >= 0 ? along[1] / 2 : 0;
    to = last_joint >= 0 ? (along[edges - 1] + along[edges]) / 2 : along[edges];
  }

  [[nodiscard]] double share_of(double length) const { return (length - from) / (to - from); }
  [[nodiscard]] Eigen::Vector3d point_at(double share) const {
    const double length = from + share * (to - from);
    Eigen::Index edge = 0;
    while (edge + 2 < along.size() && along[edge + 1] < length) ++edge;
    const double part = (length - along[edge]) / (along[edge + 1] - along[edge]);
    return (1 - part) * vertices.col(edge) + part * vertices.col(edge + 1);
  }
};

/// How far chords of the edges are from the curve through a polyline's vertices, at most about.
double chord_height(const Eigen::Ref<const Eigen::Matrix3Xd>& vertices) {
  double largest = 0;
  for (Eigen::Index v = 1; v + 1 < vertices.cols(); ++v) {
    largest = std::max(
        largest, (vertices.col(v - 1) - 2 * vertices.col(v) + vertices.col(v + 1)).squaredNorm());
  }
  return std::sqrt(largest) / 8;
}

/// Largest distance between points of the same material, the coarse shape's vertices, beyond what
/// chords of the fine shape may be off there.
double distance_between(const LiveLinkage& fine, const LinkageResult& coarse) {
  const Eigen::VectorXd now = fine.shape().coordinates(fine.model(), fine.state());
  const Eigen::VectorXd before = coarse.frames->rightCols<1>();
  const LinkageGeometry& geometry = *coarse.geometry;
  double largest = 0;
  Eigen::Index at_before = 0, at_now = 0;
  for (std::size_t s = 0; s < geometry.edges.size(); ++s) {
    const int edges = geometry.edges[s];
    const int fine_edges = fine.model().variables().edges(static_cast<int>(s));
    const auto joints = geometry.joints_of_segment.col(static_cast<Eigen::Index>(s));
    const Line line(before.data() + at_before, edges, joints[0], joints[1]);
    const Line fine_line(now.data() + at_now, fine_edges, joints[0], joints[1]);
    const double chords = chord_height(line.vertices);
    for (Eigen::Index vertex = 0; vertex <= edges; ++vertex) {
      // The part beyond a joint is half an edge, whose length differs.
      const double share = line.share_of(std::clamp(line.along[vertex], line.from, line.to));
      const double apart = (fine_line.point_at(share) - line.point_at(share)).norm();
      largest = std::max(largest, apart - chords);
    }
    at_before += 6 * Eigen::Index{edges} + 3;
    at_now += 6 * Eigen::Index{fine_edges} + 3;
  }
  return largest;
}

}  // namespace

Refinement refine(scene::Linkage linkage, const LinkageResult& coarse, const ShapeCheck& found,
                  int edges, int most, const JobContext& job) {
  linkage.shape.reset();
  linkage.shape_conditions.reset();
  linkage.conditions = *coarse.requested;
  Refinement refined;
  refined.check = found;
  int next = edges_for(edges, found.position_error(), found.tolerance);
  for (int round = 0; round < kRounds; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    linkage.edges_per_segment = std::clamp(next, edges + 1, most);
    auto live = std::make_unique<LiveLinkage>(linkage, job);
    LiveLinkage::Outcome outcome = live->solve(coarse.requested, job, [] {});
    job.throw_if_cancelled();
    if (!outcome.reached) {
      refined.failure = fmt::format("With {} edges per segment the equilibrium is not found: {}.",
                                    linkage.edges_per_segment, outcome.report.message);
      return refined;
    }
    if (distance_between(*live, coarse) >
        std::min(kSameBranch * found.error.max_distance, kMostShare * found.size)) {
      refined.failure =
          fmt::format("With {} edges per segment the conditions lead to another equilibrium.",
                      linkage.edges_per_segment);
      return refined;
    }
    ShapeCheck check{{}, found.size, found.tolerance};
    check.error = rods::DiscretisationEstimator(live->model(), live->statics()->stresses())
                      .estimate(live->model(), live->state(), live->held(), job);
    check.check_ms = milliseconds_since(begin);
    refined = {linkage.edges_per_segment, std::move(live), std::move(outcome), check, {}};
    if (!check.error.is_known() || check.within_tolerance() || refined.edges >= most) break;
    next = edges_for(refined.edges, check.position_error(), check.tolerance);
  }
  return refined;
}

}  // namespace limber::session
