#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/refinement/subdivision.h"
#include "engine/beams/solver/equilibrium.h"

namespace limber::beams {

/// An equilibrium against the limit of ever more parts of its elements, where the structure is what
/// is drawn: straight between nodes. See NOTATION.md, "Discretisation error".
struct DiscretisationError {
  bool is_known = false;  // else the message says why not
  /// Largest distance of a node of the structure from its place in the limit: over structure_size()
  /// and in [length]; which node that is.
  double position_error = 0;
  double max_distance = 0;
  int worst_node = -1;
  double energy_error = 0;    // of the elastic energy, relative
  int elements = 0;           // of the equilibrium
  int compared_elements = 0;  // of the finest one it was compared with
  /// By which power of the parts' length the distances fell from halves to quarters, in [0, 4];
  /// 0: quarters were not needed.
  double order = 0;
  std::string message;  // what is doubtful about the estimate; empty: nothing
};

/// One equilibrium of a structure whose elements are cut.
struct CutEquilibrium {
  Subdivision subdivision;
  BeamState state;  // of the cut model
};

/// What the estimate found on its way.
struct DiscretisationEstimate {
  DiscretisationError error;
  /// Per element of the structure: energy of the difference between its forces and those of its
  /// halves, the root [sqrt(force length)].
  std::vector<double> indicators;
  /// The finest equilibrium that was found.
  std::optional<CutEquilibrium> finest;
};

/// Distances that halves find above this share of the structure's size are looked at in quarters.
inline constexpr double kSmallDiscretisationError = 1e-3;

/// Elements of a cut model, where nothing else is asked for.
inline constexpr int kMaxCutElements = 20000;

/// Diagonal of the box around the nodes as drawn that elements use [length].
[[nodiscard]] double structure_size(const BeamModel& model);

/// Each part is halved, and the equilibrium next to the shape that the halves begin with is found.
/// Where nodes have moved far the same again with quarters, which say of what order the differences
/// are; else order two is assumed, the least there is: distances then count for a third more.
/// @param model  the structure, not cut
/// @param cut  its equilibrium, of cut_model(model, cut.subdivision)
/// @param max_elements  of the finest one that is compared with; where halves have more, there is
/// no estimate
/// @throws Error{kCancelled}
[[nodiscard]] DiscretisationEstimate estimate_discretisation(const BeamModel& model,
                                                             const CutEquilibrium& cut,
                                                             int max_elements = kMaxCutElements,
                                                             const JobContext& job = {});

}  // namespace limber::beams
