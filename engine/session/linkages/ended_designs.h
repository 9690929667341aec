#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "engine/scene/linkage.h"
#include "engine/session/linkages/live_design.h"

namespace limber::session {

/// The ends of the latest designs of a session: with these, a newer one can report another optimum
/// than its own.
class EndedDesigns {
 public:
  /// E_0 of an earlier design under the same pins and angles, so that their results are comparable;
  /// 0: there was none.
  [[nodiscard]] double energy_scale(const scene::LinkageConditions& conditions) const;
  /// Earlier ones for the same goal, of the same variables, asked flat angle, pins and angles,
  /// that differ from the best of this one by more than a hundredth.
  [[nodiscard]] std::vector<OtherOptimum> others_than(
      LiveDesign& design, const DesignInfo& info, const scene::LinkageConditions& conditions) const;
  /// @param info  of a design that has converged or settled
  void note(const LiveDesign& design, const DesignInfo& info,
            std::shared_ptr<const scene::LinkageConditions> conditions);

 private:
  struct Ended {
    DesignInfo info;
    std::shared_ptr<const DesignCandidate> best;
    std::shared_ptr<const scene::LinkageConditions> conditions;
    double energy_scale;
    std::optional<double> requested_flat_angle;
  };
  std::deque<Ended> ended_;  // the latest last
};

}  // namespace limber::session
