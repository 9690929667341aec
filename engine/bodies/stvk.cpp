#include "engine/bodies/stvk.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/parallel.h"

namespace limber::bodies {
namespace {

constexpr std::int64_t kGrain = 256;  // tets

using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

Eigen::Matrix3d from_six(const Vector6& six) {
  Eigen::Matrix3d full;
  full << six[0], six[3], six[5], six[3], six[1], six[4], six[5], six[4], six[2];
  return full;
}

/// Data shared by value, gradient and Hessian of one tet.
struct TetStrain {
  Eigen::Matrix3d h;  // displacement gradient
  Eigen::Matrix3d e;  // Green's strain: from h, not from F, which would lose digits near rest
  double lambda, mu, volume;

  [[nodiscard]] Eigen::Matrix3d deformation() const { return Eigen::Matrix3d::Identity() + h; }
  /// Second Piola-Kirchhoff stress of a strain [Pa].
  [[nodiscard]] Eigen::Matrix3d stress(const Eigen::Matrix3d& strain) const {
    Eigen::Matrix3d s = 2 * mu * strain;
    s.diagonal().array() += lambda * strain.trace();
    return s;
  }
  [[nodiscard]] double density(const Eigen::Matrix3d& strain) const {
    return lambda / 2 * strain.trace() * strain.trace() + mu * strain.squaredNorm();
  }
};

Eigen::Matrix3d green(const Eigen::Matrix3d& h) {
  return (h + h.transpose() + h.transpose() * h) / 2;
}

TetStrain tet_strain(const TetMesh& mesh, const GradientOperator& gradient,
                     const Eigen::Ref<const Eigen::VectorXd>& u, int tet) {
  const Material& material = mesh.material_of(tet);
  TetStrain strain;
  strain.h = gradient.apply(u, tet);
  strain.e = green(strain.h);
  strain.lambda = material.lame_lambda();
  strain.mu = material.lame_mu();
  strain.volume = gradient.volumes()[tet];
  return strain;
}

/// Elastic stress and that of the memory together.
Eigen::Matrix3d total_stress(const TetStrain& strain, const StrainMemory& memory, int tet) {
  if (memory.ratio == 0) return strain.stress(strain.e);
  return strain.stress((1 + memory.ratio) * strain.e -
                       memory.ratio * from_six(memory.strains.col(tet)));
}

Eigen::Matrix3d tension(const Eigen::Matrix3d& stress) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(stress);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

/// Block (a, b) of the second derivative is, with F = I + H and S the stress,
///   V [ (g_a . S g_b) I + lambda (F g_a)(F g_b)^T + mu ((F g_b)(F g_a)^T + (g_a . g_b) F F^T) ].
Matrix12 tet_hessian(const TetStrain& strain, const Eigen::Matrix3d& stress, double growth,
                     const GradientOperator::ShapeGradients& g) {
  const Eigen::Matrix3d f = strain.deformation();
  const Eigen::Matrix<double, 3, 4> fg = f * g;
  const Eigen::Matrix3d ff = f * f.transpose();
  const Eigen::Matrix4d pull = g.transpose() * stress * g, along = g.transpose() * g;
  const double lambda = growth * strain.lambda, mu = growth * strain.mu;
  Matrix12 result;
  for (int b = 0; b < 4; ++b) {
    for (int a = 0; a < 4; ++a) {
      Eigen::Matrix3d block = lambda * fg.col(a) * fg.col(b).transpose() +
                              mu * (fg.col(b) * fg.col(a).transpose() + along(a, b) * ff);
      block.diagonal().array() += pull(a, b);
      result.block<3, 3>(3 * a, 3 * b) = strain.volume * block;
    }
  }
  return result;
}

void demand_memory(const StrainMemory& memory, int tets) {
  LIMBER_DEMAND(memory.ratio == 0 || memory.strains.cols() == tets);
}

}  // namespace

StvkEnergy::StvkEnergy(const TetMesh& mesh, const GradientOperator& gradient)
    : mesh_(mesh), gradient_(gradient), graph_(mesh.tets, mesh.node_count()) {}

GreenStrains StvkEnergy::strains(const Eigen::Ref<const Eigen::VectorXd>& u) const {
  GreenStrains strains(6, mesh_.tet_count());
  for (int tet = 0; tet < mesh_.tet_count(); ++tet) {
    const Eigen::Matrix3d e = green(gradient_.apply(u, tet));
    strains.col(tet) << e(0, 0), e(1, 1), e(2, 2), e(0, 1), e(1, 2), e(2, 0);
  }
  return strains;
}

double StvkEnergy::value(const Eigen::Ref<const Eigen::VectorXd>& u,
                         const StrainMemory& memory) const {
  demand_memory(memory, mesh_.tet_count());
  double sum = 0;
  for (int tet = 0; tet < mesh_.tet_count(); ++tet) {
    const TetStrain strain = tet_strain(mesh_, gradient_, u, tet);
    double density = strain.density(strain.e);
    if (memory.ratio > 0) {
      density += memory.ratio * strain.density(strain.e - from_six(memory.strains.col(tet)));
    }
    sum += strain.volume * density;
  }
  return sum;
}

Eigen::VectorXd StvkEnergy::gradient(const Eigen::Ref<const Eigen::VectorXd>& u,
                                     const StrainMemory& memory) const {
  demand_memory(memory, mesh_.tet_count());
  Eigen::Matrix<double, 12, Eigen::Dynamic> parts(12, mesh_.tet_count());
  parallel_for(mesh_.tet_count(), kGrain, [&](std::int64_t begin, std::int64_t end) {
    for (int tet = static_cast<int>(begin); tet < end; ++tet) {
      const TetStrain strain = tet_strain(mesh_, gradient_, u, tet);
      const Eigen::Matrix3d piola = strain.deformation() * total_stress(strain, memory, tet);
      const Eigen::Matrix<double, 3, 4> force =
          strain.volume * piola * gradient_.shape_gradients(tet);
      parts.col(tet) = force.reshaped();
    }
  });
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(3 * mesh_.node_count());
  for (int tet = 0; tet < mesh_.tet_count(); ++tet) {
    for (int a = 0; a < 4; ++a)
      sum.segment<3>(3 * mesh_.tets(a, tet)) += parts.col(tet).segment<3>(3 * a);
  }
  return sum;
}

Eigen::SparseMatrix<double> StvkEnergy::hessian(const Eigen::Ref<const Eigen::VectorXd>& u,
                                                Curvature curvature,
                                                const StrainMemory& memory) const {
  demand_memory(memory, mesh_.tet_count());
  return graph_.assemble_vector([&](int tet) {
    const TetStrain strain = tet_strain(mesh_, gradient_, u, tet);
    Eigen::Matrix3d stress = total_stress(strain, memory, tet);
    if (curvature == Curvature::kPositive) stress = tension(stress);
    return tet_hessian(strain, stress, 1 + memory.ratio, gradient_.shape_gradients(tet));
  });
}

StvkEnergy::Inversion StvkEnergy::worst_inversion(
    const Eigen::Ref<const Eigen::VectorXd>& u) const {
  Inversion worst{std::numeric_limits<double>::infinity(), 0};
  for (int tet = 0; tet < mesh_.tet_count(); ++tet) {
    const double volume = (Eigen::Matrix3d::Identity() + gradient_.apply(u, tet)).determinant();
    if (volume < worst.smallest) worst = {volume, tet};
  }
  return worst;
}

}  // namespace limber::bodies
