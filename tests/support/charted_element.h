#pragma once

#include <Eigen/Core>
#include <array>

namespace limber::beams {

/// An element by the paper's unknowns, to compare with (bending-active, sec. 2): stretching,
/// twisting, bending about axis 2 (its first bending force) and about axis 3 (its second). At rest
/// the normals are across the element: the paper knows no other state of rest out of their plane.
struct ChartedElement {
  double length = 1;      // at rest
  double stretching = 0;  // EA
  double torsion = 0;     // GJ
  double bending_2 = 0;   // EI_2
  double bending_3 = 0;   // EI_3
  double rim = 0;         // as in normal_of_chart
};

/// What n_r, the paper's rotation about the normal, is counted from at one end: one of the node's
/// elements, its reference k.
struct ChartedReference {
  enum class Kind {
    kItself,   // the element is k: theta_3 is n_r (as in the public code)
    kElement,  // another one: its direction turned by alpha + n_r about the normal (sec. 2.4)
    kAtRest,   // held: the element's own direction at rest (the public code, at supports)
  };
  Kind kind = Kind::kItself;
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();  // that direction, of any length
  double alpha = 0;  // angle about the normal from k to the element at rest
};
using ChartedReferences = std::array<ChartedReference, 2>;  // of the start, of the finish

/// The angle alpha of two elements at a node, all as at rest; none of them along the normal.
[[nodiscard]] double charted_alpha(const Eigen::Vector3d& normal, const Eigen::Vector3d& reference,
                                   const Eigen::Vector3d& element);

/// Unknowns: position of the start, n_x, n_y and n_r of the start, then the same of the finish.
using ChartedVector = Eigen::Matrix<double, 12, 1>;

/// Not a function of the unknowns alone: directions of reference elements, which depend on
/// positions of two further nodes, enter the second bending energy.
[[nodiscard]] double charted_energy(const ChartedElement& element,
                                    const ChartedReferences& references,
                                    const ChartedVector& unknowns);

/// The derivative of that energy; minus the paper's forces. (32) to (39) are derivatives of
/// theta_3. Their special cases are misprinted, and not followed: (41) lacks n x d f_1 sin, (42)
/// the sign of its second term, and (50) cannot stand for (39) where n_j moves: it lacks f_3 . d n.
struct ChartedGradient {
  ChartedVector unknowns;
  std::array<Eigen::Vector3d, 2> references;  // by the vectors of the reference elements
};
[[nodiscard]] ChartedGradient charted_gradient(const ChartedElement& element,
                                               const ChartedReferences& references,
                                               const ChartedVector& unknowns);

}  // namespace limber::beams
