#include "engine/bodies/modal_derivatives.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/base/parallel.h"
#include "engine/bodies/dof_map.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/stiffness.h"

namespace limber::bodies {
namespace {

constexpr const char* kDerivativesStage = "modal derivatives";
// Pairs that one pass over the tets takes along.
constexpr std::int64_t kPairs = 48;
// Columns that are solved between two looks at the cancellation.
constexpr Eigen::Index kSolved = 96;
// Share of the first stiff eigenvalue that makes a singular K definite. Its effect on the known
// modes is removed exactly, and on the others to the square of kShift lambda_1 / lambda_k.
constexpr double kShift = 1e-2;

/// Contribution of a tet along one direction: displacement gradient and linear stress.
struct Direction {
  Eigen::Matrix3d h, stress;
};

Eigen::Matrix3d linear_stress(const Material& material, const Eigen::Matrix3d& strain) {
  Eigen::Matrix3d s = 2 * material.lame_mu() * strain;
  s.diagonal().array() += material.lame_lambda() * strain.trace();
  return s;
}

Direction direction(const Material& material, const Eigen::Matrix3d& h) {
  return {h, linear_stress(material, (h + h.transpose()) / 2)};
}

/// Second derivative of F S(E) along a and b at rest: both linear parts against the other's stress,
/// and the stress of the quadratic part of Green's strain.
Eigen::Matrix3d second_piola(const Material& material, const Direction& a, const Direction& b) {
  const Eigen::Matrix3d product = a.h.transpose() * b.h;
  return a.h * b.stress + b.h * a.stress +
         linear_stress(material, (product + product.transpose()) / 2);
}

void add_force(const GradientOperator& gradient, int tet, const Eigen::Matrix3d& piola,
               Eigen::Ref<Eigen::VectorXd> force) {
  const Eigen::Matrix<double, 3, 4> parts =
      gradient.volumes()[tet] * piola * gradient.shape_gradients(tet);
  for (int a = 0; a < 4; ++a) force.segment<3>(3 * gradient.tets()(a, tet)) += parts.col(a);
}

/// -(d K(u)/du [phi_i]) phi_j of all pairs, 3n x pairs.
Eigen::MatrixXd loads(const ElasticBody& body, const GradientOperator& gradient,
                      const Eigen::MatrixXd& modes, const std::vector<ModePair>& pairs) {
  Eigen::MatrixXd result =
      Eigen::MatrixXd::Zero(modes.rows(), static_cast<Eigen::Index>(pairs.size()));
  const auto count = static_cast<std::int64_t>(pairs.size());
  parallel_for((count + kPairs - 1) / kPairs, 1, [&](std::int64_t begin, std::int64_t end) {
    std::vector<Direction> along(static_cast<std::size_t>(modes.cols()));
    for (std::int64_t block = begin; block < end; ++block) {
      const std::int64_t first = block * kPairs, last = std::min(first + kPairs, count);
      std::vector<char> used(along.size(), 0);
      for (std::int64_t i = first; i < last; ++i) used[pairs[i].first] = used[pairs[i].second] = 1;
      for (int tet = 0; tet < gradient.tet_count(); ++tet) {
        const Material& material = body.mesh.material_of(tet);
        for (std::size_t k = 0; k < used.size(); ++k) {
          if (used[k] == 0) continue;
          along[k] =
              direction(material, gradient.apply(modes.col(static_cast<Eigen::Index>(k)), tet));
        }
        for (std::int64_t i = first; i < last; ++i) {
          const ModePair& pair = pairs[i];
          add_force(gradient, tet, -second_piola(material, along[pair.first], along[pair.second]),
                    result.col(i));
        }
      }
    }
  });
  return result;
}

/// K^-1 on what K resists: the complement of rigid modes and mechanisms.
class StaticSolver {
 public:
  StaticSolver(const ElasticBody& body, const GradientOperator& gradient, const ModalBasis& basis,
               const DofMap& dofs)
      : stiffness_(dofs.restrict_matrix(stiffness_matrix(body.mesh, gradient))),
        modes_(dofs.restrict_rows(basis.modes)),
        eigenvalues_(basis.eigenvalues),
        soft_(basis.rigid_count + basis.mechanism_count) {
    Eigen::SparseMatrix<double> shifted = stiffness_;
    if (soft_ > 0) {
      const Eigen::SparseMatrix<double> mass = dofs.restrict_matrix(mass_matrix(body.mesh));
      shift_ = kShift * eigenvalues_[std::min<Eigen::Index>(soft_, eigenvalues_.size() - 1)];
      shifted += shift_ * mass;
      mass_soft_ = mass * modes_.leftCols(soft_);
    }
    cholesky_.factor(shifted);
  }

  [[nodiscard]] std::size_t factor_nonzeros() const { return cholesky_.factor_nonzeros(); }

  [[nodiscard]] Eigen::MatrixXd solve(Eigen::MatrixXd b) const {
    if (soft_ == 0) {
      cholesky_.solve_in_place(b);
      return b;
    }
    equilibrate(b);
    Eigen::MatrixXd x = unshifted(b);
    Eigen::MatrixXd rest = b - stiffness_ * x;
    equilibrate(rest);
    x += unshifted(rest);
    return x - modes_.leftCols(soft_) * (mass_soft_.transpose() * x);
  }

 private:
  /// b <- b - M N N^T b with N the modes that K does not resist.
  void equilibrate(Eigen::MatrixXd& b) const {
    const Eigen::MatrixXd along = modes_.leftCols(soft_).transpose() * b;
    b -= mass_soft_ * along;
  }
  /// (K + s M)^-1 b, corrected to K^-1 b along the known modes.
  [[nodiscard]] Eigen::MatrixXd unshifted(const Eigen::MatrixXd& b) const {
    Eigen::MatrixXd x = b;
    cholesky_.solve_in_place(x);
    const auto stiff = modes_.rightCols(modes_.cols() - soft_);
    const Eigen::ArrayXd lambda = eigenvalues_.tail(stiff.cols()).array();
    const Eigen::VectorXd share = shift_ / (lambda * (lambda + shift_));
    const Eigen::MatrixXd along = share.asDiagonal() * (stiff.transpose() * b);
    x += stiff * along;
    return x;
  }

  Eigen::SparseMatrix<double> stiffness_;
  Eigen::MatrixXd modes_;  // over free degrees of freedom
  Eigen::VectorXd eigenvalues_;
  Eigen::Index soft_;  // modes that K does not resist: the first ones
  double shift_ = 0;
  Eigen::MatrixXd mass_soft_;
  SparseCholesky cholesky_;
};

}  // namespace

Eigen::VectorXd second_force_derivative(const ElasticBody& body,
                                        const Eigen::Ref<const Eigen::VectorXd>& p,
                                        const Eigen::Ref<const Eigen::VectorXd>& q) {
  const GradientOperator gradient(body.mesh);
  Eigen::MatrixXd both(p.size(), 2);
  both << p, q;
  return -loads(body, gradient, both, {{0, 1}});
}

Eigen::MatrixXd modal_derivatives(const ElasticBody& body, const ModalBasis& basis,
                                  const std::vector<ModePair>& pairs, const JobContext& job) {
  for (const ModePair& pair : pairs) {
    LIMBER_DEMAND(std::min(pair.first, pair.second) >= 0 &&
                  std::max(pair.first, pair.second) < basis.modes.cols());
  }
  job.report(kDerivativesStage, 0);
  const GradientOperator gradient(body.mesh);
  const DofMap dofs = DofMap::of_vectors(body.mesh.node_count(), body.fixed_nodes);
  const StaticSolver solver(body, gradient, basis, dofs);
  job.report(kDerivativesStage, 0.2);
  const Eigen::MatrixXd all = loads(body, gradient, basis.modes, pairs);
  Eigen::MatrixXd result(all.rows(), all.cols());
  for (Eigen::Index first = 0; first < all.cols(); first += kSolved) {
    job.report(kDerivativesStage,
               0.4 + 0.6 * static_cast<double>(first) / static_cast<double>(all.cols()));
    const Eigen::Index count = std::min(kSolved, all.cols() - first);
    result.middleCols(first, count) =
        dofs.expand_rows(solver.solve(dofs.restrict_rows(all.middleCols(first, count))));
  }
  job.report(kDerivativesStage, 1);
  return result;
}

}  // namespace limber::bodies
