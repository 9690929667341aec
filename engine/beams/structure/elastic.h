#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams {

/// Elastic energies of a structure [force length].
struct BeamEnergies {
  double stretching = 0, torsion = 0, bending_2 = 0, bending_3 = 0;

  [[nodiscard]] double total() const { return stretching + torsion + bending_2 + bending_3; }
};

[[nodiscard]] BeamEnergies elastic_energies(const BeamStructure& structure, const BeamState& state);

/// Is anything strained beyond rounding?
[[nodiscard]] bool carries_forces(const BeamStructure& structure, const BeamState& state);

/// dU by all unknowns, held ones too.
[[nodiscard]] Eigen::VectorXd elastic_gradient(const BeamStructure& structure,
                                               const BeamState& state);

/// Second derivatives of U by the free unknowns, and from held to free ones: the pattern is found
/// once. Entries add up in the order of the elements, so that sums are the same on any machine.
class Stiffness {
 public:
  explicit Stiffness(const BeamStructure& structure);

  /// Rows of the matrix against unknowns of the structure.
  [[nodiscard]] const std::vector<int>& free_unknowns() const { return free_; }
  /// -1: held.
  [[nodiscard]] int row_of(int unknown) const { return row_of_[static_cast<std::size_t>(unknown)]; }
  [[nodiscard]] int size() const { return static_cast<int>(free_.size()); }

  void assemble(const BeamState& state, Compression compression = Compression::kCounts);
  /// The same with the potential of loads over elements that keep their direction.
  void assemble(const BeamState& state, const NodeLoads& loads,
                Compression compression = Compression::kCounts);

  /// Lower triangle.
  [[nodiscard]] const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }
  /// matrix * v, by both triangles.
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& v) const;
  /// Change of the gradient at free unknowns by increments of held ones (a vector over all of them;
  /// free entries are not read).
  [[nodiscard]] Eigen::VectorXd from_held(const Eigen::VectorXd& increments) const;

  [[nodiscard]] Eigen::VectorXd restricted(const Eigen::VectorXd& all) const;
  [[nodiscard]] Eigen::VectorXd extended(const Eigen::VectorXd& free) const;  // zero where held

 private:
  void add_up();

  const BeamStructure& structure_;
  std::vector<int> free_;
  std::vector<int> row_of_;  // -1: held
  Eigen::SparseMatrix<double> matrix_;
  std::vector<std::vector<std::pair<int, int>>> places_;  // per element: local entry, value's place
  std::vector<Eigen::MatrixXd> local_;                    // of the last assembly
};

}  // namespace limber::beams
