#include "engine/bodies/smooth_modes.h"

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/bodies/dof_map.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/rigid_modes.h"
#include "engine/bodies/shift_invert.h"
#include "engine/bodies/stiffness.h"

namespace limber::bodies {
namespace {

using Eigen::Index;

constexpr int kAffine = 12;         // fields: a translation along an axis times 1, x, y or z
constexpr int kFunctionSteps = 4;   // of subspace iteration: the span is enough, not the functions
constexpr int kExtraFunctions = 4;  // columns that the iteration takes along
constexpr double kRounding = 1e-6;  // share of a field that is left beside rigid motions
constexpr double kLeastShare = 1e-9;  // share of the largest eigenvalue of the columns' Gram matrix

/// Eigenfunctions of the Laplacian over free nodes, n x k; for a free body without the constant.
Eigen::MatrixXd smooth_functions(const ElasticBody& body, const GradientOperator& gradient,
                                 const Eigen::VectorXd& mass, int count, const JobContext& job) {
  const DofMap dofs = DofMap::of_scalars(body.mesh.node_count(), body.fixed_nodes);
  Eigen::SparseMatrix<double> diagonal(mass.size(), mass.size());
  diagonal.reserve(Eigen::VectorXi::Constant(mass.size(), 1));
  for (Index i = 0; i < mass.size(); ++i) diagonal.insert(i, i) = mass[i];
  diagonal.makeCompressed();
  Eigen::MatrixXd constant(dofs.free_count(), 0);
  if (body.is_free()) constant.setConstant(dofs.free_count(), 1, 1 / std::sqrt(mass.sum()));
  const ShiftInvert op(dofs.restrict_matrix(gradient.scalar_laplacian()),
                       dofs.restrict_matrix(diagonal), constant, job);
  const Index most = op.size() - constant.cols();
  Eigen::MatrixXd start(op.size(), std::min<Index>(count + kExtraFunctions, most));
  Random random(4);
  for (double& entry : start.reshaped()) entry = random.uniform(-1, 1);
  op.project(start);
  RitzBlock ritz;
  ritz.mass_vectors = op.multiply_mass(start);
  for (int step = 0; step < kFunctionSteps; ++step) {
    job.throw_if_cancelled();
    ritz = subspace_step(op, ritz.mass_vectors);
  }
  const Eigen::MatrixXd found =
      dofs.expand_rows(ritz.vectors.leftCols(std::min<Index>(count, most)));
  if (!body.is_free()) return found;
  Eigen::MatrixXd all(found.rows(), found.cols() + 1);
  all << Eigen::VectorXd::Ones(found.rows()), found;
  return all;
}

/// Products of functions with affine fields, 3n x 12 k.
Eigen::MatrixXd affine_products(const ElasticBody& body, const Eigen::MatrixXd& functions) {
  const Eigen::Matrix3Xd& x = body.mesh.nodes;
  const Eigen::Vector3d centre = x.rowwise().mean();
  const double length = body.length();
  Eigen::MatrixXd fields = Eigen::MatrixXd::Zero(3 * x.cols(), kAffine * functions.cols());
  parallel_for(functions.cols(), 1, [&](std::int64_t k, std::int64_t) {
    for (int factor = 0; factor < 4; ++factor) {
      for (int axis = 0; axis < 3; ++axis) {
        auto column = fields.col(kAffine * k + 3 * factor + axis);
        for (Index node = 0; node < x.cols(); ++node) {
          const double affine =
              factor == 0 ? 1 : (x(factor - 1, node) - centre[factor - 1]) / length;
          column[3 * node + axis] = affine * functions(node, k);
        }
      }
    }
  });
  return fields;
}

/// A^T B, symmetric in exact arithmetic, by blocks of columns.
Eigen::MatrixXd symmetric_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  constexpr std::int64_t kColumns = 16;
  Eigen::MatrixXd result(a.cols(), b.cols());
  parallel_for(b.cols(), kColumns, [&](std::int64_t begin, std::int64_t end) {
    result.middleCols(begin, end - begin).noalias() =
        a.transpose() * b.middleCols(begin, end - begin);
  });
  return (result + result.transpose()) / 2;
}

}  // namespace

void SmoothModesOptions::validate() const {
  const auto demand = [](int value, const char* member) {
    if (value > 0) return;
    throw Error(ErrorCode::kInvalidArgument, member,
                fmt::format("SmoothModesOptions::{} = {}, must be > 0", member, value));
  };
  demand(mode_count, "mode_count");
  demand(function_count, "function_count");
}

ModalBasis smooth_modes(const ElasticBody& body, const SmoothModesOptions& options,
                        const JobContext& job) {
  options.validate();
  const GradientOperator gradient(body.mesh);
  const Eigen::VectorXd node_mass = lumped_node_mass(body.mesh);
  Eigen::VectorXd mass(3 * node_mass.size());
  for (Index i = 0; i < node_mass.size(); ++i) mass.segment<3>(3 * i).setConstant(node_mass[i]);
  Eigen::MatrixXd rigid(mass.size(), 0);
  if (body.is_free()) rigid = rigid_modes(body.mesh).modes;

  Eigen::MatrixXd fields = affine_products(
      body, smooth_functions(body, gradient, node_mass, options.function_count, job));
  job.throw_if_cancelled();
  const Eigen::VectorXd whole = (mass.cwiseSqrt().asDiagonal() * fields).colwise().norm();
  if (rigid.cols() > 0) {
    // They are orthonormal under the consistent mass only.
    const Eigen::MatrixXd weighted = mass.asDiagonal() * rigid;
    const Eigen::LLT<Eigen::MatrixXd> gram(rigid.transpose() * weighted);
    fields -= rigid * gram.solve(weighted.transpose() * fields);
  }
  Eigen::MatrixXd projected_mass = symmetric_product(fields, mass.asDiagonal() * fields);
  Eigen::VectorXd scale(fields.cols());
  for (Index k = 0; k < fields.cols(); ++k) {
    // The remainder of a field that was a rigid motion is rounding.
    const double left = std::sqrt(projected_mass(k, k));
    scale[k] = left > kRounding * whole[k] ? 1 / left : 0;
  }
  projected_mass = (scale.asDiagonal() * projected_mass * scale.asDiagonal()).eval();
  const SymmetricEigen range(projected_mass);
  const Eigen::VectorXd& sizes = range.eigenvalues();  // ascending
  const double largest = sizes[sizes.size() - 1];
  Index kept = 0;
  while (kept < sizes.size() && sizes[sizes.size() - 1 - kept] > kLeastShare * largest) ++kept;
  const Eigen::MatrixXd directions = scale.asDiagonal() * range.eigenvectors().rightCols(kept) *
                                     sizes.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
  job.throw_if_cancelled();

  // Held nodes have zeros in the fields: the whole matrix does.
  const Eigen::SparseMatrix<double> stiffness = stiffness_matrix(body.mesh, gradient);
  job.throw_if_cancelled();
  const Eigen::MatrixXd energies = symmetric_product(fields, multiply_columns(stiffness, fields));
  const SymmetricEigen ritz(directions.transpose() * energies * directions);
  const int rigid_count = static_cast<int>(rigid.cols());
  const Index count = std::min<Index>(options.mode_count, kept);
  if (count <= 0 || !(ritz.eigenvalues()[count - 1] > 0)) {
    throw Error(ErrorCode::kNumerical, "modes", "the smooth fields have no elastic mode");
  }
  ModalBasis basis;
  basis.rigid_count = rigid_count;
  basis.max_residual = 1;
  basis.eigenvalues.setZero(rigid_count + count);
  // Mechanisms that the space finds have rounding noise, of any sign.
  basis.eigenvalues.tail(count) =
      ritz.eigenvalues().head(count).cwiseMax(1e-9 * ritz.eigenvalues()[count - 1]);
  basis.modes.resize(mass.size(), rigid_count + count);
  basis.modes.leftCols(rigid_count) = rigid;
  basis.modes.rightCols(count) = fields * (directions * ritz.eigenvectors().leftCols(count));
  return basis;
}

}  // namespace limber::bodies
