#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// G of a linear tet mesh (paper: space-time editing, section 3.1). It maps nodal displacements u
/// (3n, ordered 3 * node + axis) to the displacement gradient of each tet, H(i, j) = d u_i / d X_j,
/// constant in the tet.
///
/// Nine numbers per tet, H column-major: entry (i, j) of tet e is row 9 e + 3 j + i. All values
/// refer to the rest shape.
class GradientOperator {
 public:
  using ShapeGradients = Eigen::Map<const Eigen::Matrix<double, 3, 4>>;

  /// @param mesh  every tet positively oriented with positive volume (from prepare_mesh)
  explicit GradientOperator(const TetMesh& mesh);

  [[nodiscard]] int node_count() const { return node_count_; }
  [[nodiscard]] int tet_count() const { return static_cast<int>(tets_.cols()); }
  [[nodiscard]] const TetNodes& tets() const { return tets_; }

  /// V, volume of each tet [m^3].
  [[nodiscard]] const Eigen::VectorXd& volumes() const { return volumes_; }

  /// Column a is the gradient of the shape function of corner a of the tet [1/m].
  [[nodiscard]] ShapeGradients shape_gradients(int tet) const {
    return ShapeGradients(shape_gradients_.col(tet).data());
  }

  /// g = G u, 9m. Both are resized or must have the right size; no allocation if `g` has it.
  void apply(const Eigen::Ref<const Eigen::VectorXd>& u, Eigen::VectorXd& g) const;
  /// G u of one tet.
  [[nodiscard]] Eigen::Matrix3d apply(const Eigen::Ref<const Eigen::VectorXd>& u, int tet) const;

  /// f = G^T V g, 3n: the right-hand side of the reconstruction of u from displacement gradients g
  /// (9m).
  void apply_transposed_weighted(const Eigen::Ref<const Eigen::VectorXd>& g,
                                 Eigen::VectorXd& f) const;

  /// G as a matrix, 9m x 3n.
  [[nodiscard]] Eigen::SparseMatrix<double> matrix() const;

  /// L, n x n (full, symmetric): sum over tets of V grad N_a . grad N_b [m]. G^T V G is L on each
  /// axis.
  [[nodiscard]] Eigen::SparseMatrix<double> scalar_laplacian() const;

 private:
  int node_count_ = 0;
  TetNodes tets_;
  Eigen::VectorXd volumes_;
  Eigen::Matrix<double, 12, Eigen::Dynamic> shape_gradients_;  // 3 x 4 per tet, column-major
};

}  // namespace limber::bodies
