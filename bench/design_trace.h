#pragma once

#include <vector>

#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/design_rank.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::bench {

/// CPU time of the calling thread [s].
[[nodiscard]] double thread_seconds();

/// The designs that a search stood at, by the CPU time of its thread.
class DesignTrace {
 public:
  struct Best {
    double seconds = 0;
    int iteration = 0;
    rods::DesignValues values;
    rods::DesignRank rank;
  };

  /// Begins the clock. @param asked  both constraints
  DesignTrace(const rods::LinkageDesign& design, const rods::DesignOptimizerOptions& options);

  void note(int iteration, const rods::DesignValues& values);
  [[nodiscard]] double seconds() const { return thread_seconds() - start_; }

  // The best of those noted until then; the first must have been. Designs are compared as the
  // optimiser's: those that keep both constraints by their objectives, before all others.
  [[nodiscard]] const Best& best_at(double seconds) const;
  [[nodiscard]] const Best& best_after(int iterations) const;
  [[nodiscard]] const Best& best() const { return bests_.back(); }

  // Measures of values, by the design's scales. Root mean square over the joints [length].
  [[nodiscard]] double distance(const rods::DesignValues& values) const;
  /// Share of the length scale, root mean square.
  [[nodiscard]] double flat_height(const rods::DesignValues& values) const;

 private:
  double start_, joints_, length_scale_;
  double target_flat_height_, target_angle_;
  std::vector<Best> bests_;  // each comes before the one before
};

}  // namespace limber::bench
