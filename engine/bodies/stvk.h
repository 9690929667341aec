#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/node_graph.h"
#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Green strains of every tet, xx yy zz xy yz zx of E in a column [1].
using GreenStrains = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// A shape that the material remembers: on top of the elastic energy, `ratio` times the energy that
/// the strain since then would store. With ratio = (relaxation time) / (time step) this is the
/// dissipation of a Kelvin-Voigt solid over one implicit step; it does not resist rotation.
struct StrainMemory {
  GreenStrains strains;
  double ratio = 0;  // >= 0; 0: nothing is remembered, strains may be empty
};

/// St. Venant-Kirchhoff elasticity of linear tets, sums over tets of
///   V (lambda/2 tr(E)^2 + mu E : E),   E = (H + H^T + H^T H) / 2 (Green's strain).
/// Invariant under rigid motions; its Hessian at rest is stiffness_matrix(). Strong compression
/// (beyond 42 % along an axis) makes it weaker again, down to a tet without volume: reports of what
/// uses it say so (FullDynamics).
///
/// Displacements u are 3n, ordered 3 * node + axis [m]. Const and thread-safe; sums are in the
/// order of the tets, for any number of threads.
class StvkEnergy {
 public:
  enum class Curvature {
    kExact,     // the second derivative, indefinite in compression
    kPositive,  // with the tension part of the stress only: positive semidefinite
  };

  /// `mesh` and `gradient` are kept by reference and must outlive this.
  StvkEnergy(const TetMesh& mesh, const GradientOperator& gradient);

  [[nodiscard]] GreenStrains strains(const Eigen::Ref<const Eigen::VectorXd>& u) const;

  /// [J]
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& u,
                             const StrainMemory& memory = {}) const;
  /// d value / d u, 3n [N]: minus the elastic force.
  [[nodiscard]] Eigen::VectorXd gradient(const Eigen::Ref<const Eigen::VectorXd>& u,
                                         const StrainMemory& memory = {}) const;
  /// 3n x 3n, full, of the same pattern for every u [N/m].
  [[nodiscard]] Eigen::SparseMatrix<double> hessian(const Eigen::Ref<const Eigen::VectorXd>& u,
                                                    Curvature curvature,
                                                    const StrainMemory& memory = {}) const;

  /// Smallest det(I + H) over the tets: below zero a tet is turned inside out. And which one.
  struct Inversion {
    double smallest = 1;
    int tet = 0;
  };
  [[nodiscard]] Inversion worst_inversion(const Eigen::Ref<const Eigen::VectorXd>& u) const;

 private:
  const TetMesh& mesh_;
  const GradientOperator& gradient_;
  NodeGraph graph_;
};

}  // namespace limber::bodies
