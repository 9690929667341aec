#include "bench/stability/long_elasticity.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <vector>

namespace limber::bench::stability {
namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using Sparse = Eigen::SparseMatrix<Real>;

struct Pencil {
  Sparse stiffness, mass;  // free unknowns
  std::vector<int> full_of_free;
};

Pencil assemble(const bodies::ElasticBody& body) {
  const bodies::TetMesh& mesh = body.mesh;
  std::vector<char> fixed(static_cast<std::size_t>(mesh.node_count()), 0);
  for (const int node : body.fixed_nodes) fixed[static_cast<std::size_t>(node)] = 1;
  Pencil pencil;
  std::vector<int> free_of(static_cast<std::size_t>(3 * mesh.node_count()), -1);
  for (int u = 0; u < 3 * mesh.node_count(); ++u) {
    if (fixed[static_cast<std::size_t>(u / 3)] != 0) continue;
    free_of[static_cast<std::size_t>(u)] = static_cast<int>(pencil.full_of_free.size());
    pencil.full_of_free.push_back(u);
  }
  std::vector<Eigen::Triplet<Real>> stiffness, mass;
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const Eigen::Vector4i tet = mesh.tets.col(e);
    Matrix3 edges;
    for (int a = 0; a < 3; ++a)
      edges.col(a) = mesh.nodes.col(tet[a + 1]).cast<Real>() - mesh.nodes.col(tet[0]).cast<Real>();
    const Real volume = edges.determinant() / 6;
    Eigen::Matrix<Real, 3, 4> slope;  // of the shape functions
    slope.rightCols<3>() = edges.inverse().transpose();
    slope.col(0) = -slope.rightCols<3>().rowwise().sum();
    const bodies::Material& material = mesh.material_of(e);
    const Real young = material.youngs_modulus, nu = material.poissons_ratio;
    const Real lambda = young * nu / ((1 + nu) * (1 - 2 * nu)), mu = young / (2 * (1 + nu));
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        const Real both = slope.col(a).dot(slope.col(b));
        const Real shared = material.density * volume / 20 * (a == b ? 2 : 1);
        for (int i = 0; i < 3; ++i) {
          const int row = free_of[static_cast<std::size_t>(3 * tet[a] + i)];
          for (int j = 0; j < 3; ++j) {
            const int column = free_of[static_cast<std::size_t>(3 * tet[b] + j)];
            if (row < 0 || column < 0) continue;
            stiffness.emplace_back(
                row, column,
                volume * (lambda * slope(i, a) * slope(j, b) + mu * slope(j, a) * slope(i, b) +
                          (i == j ? mu * both : 0)));
            if (i == j) mass.emplace_back(row, column, shared);
          }
        }
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(pencil.full_of_free.size());
  pencil.stiffness.resize(size, size);
  pencil.mass.resize(size, size);
  pencil.stiffness.setFromTriplets(stiffness.begin(), stiffness.end());
  pencil.mass.setFromTriplets(mass.begin(), mass.end());
  return pencil;
}

}  // namespace

ModalCheck check_modes(const bodies::ElasticBody& body, const bodies::ModalBasis& basis) {
  const Pencil pencil = assemble(body);
  const Matrix modes = basis.modes(pencil.full_of_free, Eigen::all).cast<Real>();
  const Matrix inertia = pencil.mass * modes;
  const Matrix gram = modes.transpose() * inertia;
  ModalCheck check;
  check.error = static_cast<double>(
      (gram - Matrix::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff());
  const int first = basis.rigid_count + basis.mechanism_count;
  const Vector weight = pencil.stiffness.diagonal().cwiseSqrt().cwiseInverse();
  for (Eigen::Index k = first; k < modes.cols(); ++k) {
    const Real lambda = basis.eigenvalues[k];
    const Vector force = pencil.stiffness * modes.col(k);
    const Real energy = modes.col(k).dot(force);
    const Real residual = (force - lambda * inertia.col(k)).cwiseProduct(weight).norm();
    check.eigenvalue_error =
        std::max(check.eigenvalue_error, static_cast<double>(std::abs(energy / lambda - 1)));
    check.residual = std::max(check.residual, static_cast<double>(residual / std::sqrt(lambda)));
  }
  check.error = std::max({check.error, check.eigenvalue_error, check.residual});
  // Between two eigenvalues that are far apart no rounding of sigma matters.
  Eigen::Index below = first;
  double widest = 0;
  for (Eigen::Index k = first; k + 1 < modes.cols(); ++k) {
    const double gap = basis.eigenvalues[k + 1] / basis.eigenvalues[k];
    if (gap < widest) continue;
    widest = gap;
    below = k;
  }
  if (below + 1 >= modes.cols()) return check;
  const Real sigma = std::sqrt(static_cast<Real>(basis.eigenvalues[below]) *
                               static_cast<Real>(basis.eigenvalues[below + 1]));
  const Eigen::SimplicialLDLT<Sparse> factor(pencil.stiffness - sigma * pencil.mass);
  check.listed = static_cast<int>(below) + 1;
  check.counted = factor.info() == Eigen::Success
                      ? static_cast<int>((factor.vectorD().array() < 0).count())
                      : -1;
  return check;
}

}  // namespace limber::bench::stability
