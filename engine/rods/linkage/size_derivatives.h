#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// Derivatives of a linkage's elastic energy E(x, L) for adjoints: those by sizes alone (rest
/// lengths of segments and edges, scales of sections), and their changes with the shape. They are
/// the parts by sizes of LinkageDerivatives' gradient and second, at the source, in one pass over
/// strains and their slopes. Frames turn as rigid bodies there, and no force is needed.
///
/// Memory is allocated once. Results do not depend on the number of threads.
class SizeDerivatives {
 public:
  /// @pre the model outlives this; changes of its rest lengths are seen
  explicit SizeDerivatives(const LinkageModel& model);

  /// share * dE/dL + d/dx (dE/dL) v.
  /// @param v  change of the unknowns, variables().size() numbers
  /// @returns lengths and edges [force], sections [force length], each times what share and v are
  /// in; its unknowns are empty. Overwritten by the next call
  [[nodiscard]] const LinkageVector& evaluate(const LinkageState& state, double share,
                                              const Eigen::Ref<const Eigen::VectorXd>& v);
  /// share * dE/dL, the same with v = 0.
  [[nodiscard]] const LinkageVector& evaluate(const LinkageState& state, double share);

 private:
  void evaluate_batches(const LinkageState& state, double share, const double* v);
  void evaluate_batch(const LinkageState& state, double share, const double* v, int batch);
  void gather();

  const LinkageModel& model_;
  std::vector<detail::LaneCell> by_slot_;  // rest lengths
  RestLengths by_edge_;                    // terminal ones; of free ones the sums
  LinkageVector result_;
};

}  // namespace limber::rods
