#include "engine/session/linkages/edge_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/rods/equilibrium/discretisation_error.h"
#include "engine/rods/linkage/drawn_extent.h"
#include "engine/session/linkages/live_problem.h"

namespace limber::session {
namespace {

constexpr int kLeastEdges = 3, kFirstEdges = 5;
constexpr int kRounds = 4;
/// The square of the edges' length is how errors go in the limit, not with five edges.
constexpr double kMargin = 1.1;
/// Share of the size: shapes that finer edges change less are not deformed.
constexpr double kUndeformed = 1e-9;

/// The error of positions with the scene's edges.
struct Worth {
  double position_error = 0;
  std::string message;  // where it is not known
};
Worth worth_of(const scene::Linkage& linkage, const JobContext& job) {
  LiveLinkage live(linkage, job);
  const auto conditions = std::make_shared<const scene::LinkageConditions>(linkage.conditions);
  const LiveLinkage::Outcome outcome = live.solve(conditions, {job.cancellation, {}}, [] {});
  job.throw_if_cancelled();
  if (!outcome.reached)
    return {0, fmt::format("the scene's equilibrium is not found: {}", outcome.report.message)};
  const rods::DiscretisationError error =
      rods::DiscretisationEstimator(live.model())
          .estimate(live.model(), live.state(), live.held(), {job.cancellation, {}});
  if (!error.is_known()) return {0, error.message};
  const double share = error.max_distance / rods::drawn_extent(live.model().graph());
  if (share < kUndeformed) return {0, "the linkage is not deformed as it is opened"};
  return {share, {}};
}

}  // namespace

int edges_for(int edges, double error, double tolerance) {
  const double wanted = std::ceil(kMargin * edges * std::sqrt(error / tolerance));
  return static_cast<int>(std::min(wanted, 1e6));
}

EdgeChoice choose_edges(scene::Linkage linkage, int most, const JobContext& job) {
  linkage.shape.reset();
  linkage.shape_conditions.reset();
  EdgeChoice met;  // the coarsest that is within the tolerance
  met.edges = 0;
  int edges = std::min(kFirstEdges, most);
  EdgeChoice tried;
  for (int round = 0; round < kRounds; ++round) {
    job.report("edges per segment", static_cast<double>(round) / kRounds);
    linkage.edges_per_segment = edges;
    const Worth worth = worth_of(linkage, job);
    if (!worth.message.empty()) {
      if (met.edges > 0) return met;
      return {std::min(kUsualEdges, most), 0,
              fmt::format("{} edges per segment, not chosen for the tolerance: {}",
                          std::min(kUsualEdges, most), worth.message)};
    }
    tried = {edges, worth.position_error, {}};
    const int wanted = edges_for(edges, worth.position_error, linkage.tolerance);
    if (worth.position_error <= linkage.tolerance) {
      met = tried;
      const int coarser = std::max(kLeastEdges, wanted);
      if (round > 0 || coarser >= edges) return met;
      edges = coarser;
    } else {
      if (met.edges > 0) return met;
      if (edges >= most) break;
      edges = std::clamp(wanted, edges + 1, most);
    }
  }
  tried.message = fmt::format(
      "With {} edges per segment positions are off by {:.2g} of the linkage's size: more than the "
      "tolerance, {:.2g}. At most {} are chosen; edges_per_segment can ask for more.",
      tried.edges, tried.position_error, linkage.tolerance, most);
  return tried;
}

}  // namespace limber::session
