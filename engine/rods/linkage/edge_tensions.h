#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/solver/lanes.h"

namespace limber::rods {

/// Forces along the edges of a linkage, tension positive, by slot and lane.
class EdgeTensions {
 public:
  explicit EdgeTensions(const LinkageModel& model) : cells_(model.slots()) {}

  /// Computes the tensions that the edges of a shape would carry after a step if they stretched
  /// linearly along it. The shape after the step carries much else: turning edges have stretched to
  /// second order, stiff as they are, and their false forces spoil the Hessian there. Newton's
  /// method with these in their place takes far fewer and longer steps, to the same equilibria
  /// (mixed iterations: Magisano, Leonetti, Garcea 2017, CMAME 313).
  void expect(const LinkageModel& model, const LinkageState& from,
              const Eigen::Ref<const Eigen::VectorXd>& step);

  /// n x lanes, for the batch's edges.
  [[nodiscard]] const double* of(const LinkageModel& model, int batch) const {
    return cells_[model.first_slot(batch)].values;
  }

 private:
  std::vector<detail::LaneCell> cells_;
};

}  // namespace limber::rods
