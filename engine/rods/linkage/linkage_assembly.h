#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/compression.h"
#include "engine/rods/linkage/edge_tensions.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/rod/rod_state.h"
#include "engine/rods/solver/condensed_matrix.h"

namespace limber::rods {

/// Elastic energy of a linkage, its gradient and its Hessian by the reduced unknowns (increments
/// from the state; rod linkages, sec. 1.4, 1.5.1). Memory is allocated once. Segments go four at a
/// time and batches in parallel; sums do not depend on the number of threads.
class LinkageAssembly {
 public:
  /// @pre the model outlives this; changes of its rest lengths are seen
  explicit LinkageAssembly(const LinkageModel& model);

  [[nodiscard]] RodEnergies energies(const LinkageState& state);
  /// @param gradient  variables().size() numbers
  RodEnergies gradient(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient);
  /// @param hessian  of the model's chains; overwritten
  RodEnergies hessian(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                      CondensedMatrix& hessian, Compression compression = Compression::kBuckles);

  /// Gradient and Hessian as if the edges carried these forces.
  RodEnergies hessian(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                      CondensedMatrix& hessian, const EdgeTensions& tensions);

  /// How the gradient changes when rest lengths and sections do: d/dL (dE/dx) v.
  /// @param sizes   v; its unknowns are not looked at
  /// @param change  variables().size() numbers, written
  void gradient_change(const LinkageState& state, const LinkageVector& sizes,
                       Eigen::Ref<Eigen::VectorXd> change);

  /// Energy of each segment at the last evaluation.
  [[nodiscard]] Eigen::VectorXd segment_energies() const;
  /// By the unknowns of the joint at a segment's end: the part of the last gradient that is the
  /// segment's own energy's. @param state  of that gradient
  [[nodiscard]] Eigen::Matrix<double, kJointUnknowns, 1> end_gradient(const LinkageState& state,
                                                                      int segment, End end) const;

 private:
  RodEnergies hessian_as(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                         CondensedMatrix& hessian, Compression compression,
                         const EdgeTensions* tensions);
  void finish_joints(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                     CondensedMatrix* hessian);
  RodEnergies total() const;
  /// Stretching, bending, twisting of a batch: 3 x lanes.
  [[nodiscard]] double* energies_of(int batch) {
    return energies_[3 * static_cast<std::size_t>(batch)].values;
  }
  [[nodiscard]] const double* energies_of(int batch) const {
    return energies_[3 * static_cast<std::size_t>(batch)].values;
  }
  void collect(int batch, Eigen::Ref<Eigen::VectorXd> gradient);

  const LinkageModel& model_;
  std::vector<detail::LaneCell> numbers_;  // gradients by chain number, by batch
  std::vector<std::size_t> first_number_;
  std::vector<detail::LaneCell> energies_;  // three by batch
  std::vector<detail::LaneCell> rests_;     // changes by slot
  std::vector<std::vector<int>> ends_;      // of each joint: 2 segment + end
  std::vector<Eigen::Matrix<double, kTerminalNumbers, 1>> end_gradients_;  // 2 segment + end
};

}  // namespace limber::rods
