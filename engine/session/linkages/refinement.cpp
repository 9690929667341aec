#include "engine/session/linkages/refinement.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "engine/session/linkages/edge_choice.h"
#include "engine/session/linkages/session.h"

namespace limber::session {
namespace {

constexpr int kRounds = 3;
/// Joints farther apart than so many times the estimated error of the given edges are of another
/// equilibrium.
constexpr double kSameBranch = 3;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// Largest distance of a joint between two shapes.
double joint_distance(const LiveLinkage& fine, const LinkageResult& coarse) {
  const Eigen::Matrix3Xd before = coarse.shape->joints(coarse.frames->rightCols<1>());
  const Eigen::Matrix3Xd now =
      fine.shape().joints(fine.shape().coordinates(fine.model(), fine.state()));
  return before.cols() > 0 ? (now - before).colwise().norm().maxCoeff() : 0;
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
    if (joint_distance(*live, coarse) > kSameBranch * found.error.max_distance) {
      refined.failure =
          fmt::format("With {} edges per segment the conditions lead to another equilibrium.",
                      linkage.edges_per_segment);
      return refined;
    }
    ShapeCheck check{{}, found.size, found.tolerance};
    check.error = rods::DiscretisationEstimator(live->model())
                      .estimate(live->model(), live->state(), live->held(), job);
    check.check_ms = milliseconds_since(begin);
    refined = {linkage.edges_per_segment, std::move(live), std::move(outcome), check, {}};
    if (!check.error.is_known() || check.within_tolerance() || refined.edges >= most) break;
    next = edges_for(refined.edges, check.position_error(), check.tolerance);
  }
  return refined;
}

}  // namespace limber::session
