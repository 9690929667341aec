#pragma once

#include <string>

#include "engine/base/job.h"
#include "engine/scene/linkage.h"

namespace limber::session {

/// Edges per segment where a tolerance cannot say how many.
inline constexpr int kUsualEdges = 10;
/// At most so many are chosen for a tolerance.
inline constexpr int kMostChosenEdges = 60;

/// How many edges per segment a tolerance takes.
struct EdgeChoice {
  int edges = kUsualEdges;
  double position_error = 0;  // estimated with them, share of the linkage's size; 0: not known
  std::string message;        // why they are not chosen for the tolerance, or miss it
};

/// Solves for the equilibrium under the scene's conditions and estimates its discretisation error,
/// which is proportional to the square of the edges' length. It then repeats with the number of
/// edges that follows: more, or fewer. If the shape is not deformed or not found, there is nothing
/// to estimate: kUsualEdges.
/// @param linkage  with a tolerance; its edges_per_segment and shape are not looked at
/// @param most  edges per segment, >= 3
/// @throws Error{kCancelled}; as LiveLinkage
[[nodiscard]] EdgeChoice choose_edges(scene::Linkage linkage, int most, const JobContext& job = {});

/// Edges per segment that bring an estimated error to a tolerance, with a margin.
/// @param error, tolerance  of positions, in the same unit, > 0
[[nodiscard]] int edges_for(int edges, double error, double tolerance);

}  // namespace limber::session
