#pragma once

#include <memory>
#include <string>

#include "engine/base/job.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/live_problem.h"
#include "engine/session/linkages/shape_check.h"

namespace limber::session {

struct LinkageResult;

/// A linkage cut into more edges because the shape that it showed missed its tolerance, in
/// equilibrium under the same conditions.
struct Refinement {
  int edges = 0;                      // per segment
  std::unique_ptr<LiveLinkage> live;  // null where none was found
  LiveLinkage::Outcome outcome;       // of its solve
  ShapeCheck check;                   // of its shape
  std::string failure;                // why there is none, a sentence
};

/// Cuts the linkage anew, as opening the scene with these conditions would. Finer edges are solved
/// from the drawing. They are accepted if their shape agrees with the given one at every vertex,
/// within the error of the given edges, so that the linkage stays on its branch. More edges are
/// tried as long as the tolerance is missed.
/// @param linkage     as opened, with a tolerance
/// @param coarse      a final result that was reached, without edge lengths of its own
/// @param found       what its edges are worth: known, and not within the tolerance
/// @param edges       per segment that it has
/// @param most        per segment, > edges
/// @throws Error{kCancelled}
[[nodiscard]] Refinement refine(scene::Linkage linkage, const LinkageResult& coarse,
                                const ShapeCheck& found, int edges, int most,
                                const JobContext& job = {});

}  // namespace limber::session
