#include "engine/bodies/gradient_operator.h"

#include <Eigen/Geometry>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/bodies/node_graph.h"
#include "engine/bodies/tet_geometry.h"

namespace limber::bodies {
namespace {
constexpr int kTetsPerChunk = 4096;
}

GradientOperator::GradientOperator(const TetMesh& mesh)
    : node_count_(mesh.node_count()),
      tets_(mesh.tets),
      volumes_(mesh.tet_count()),
      shape_gradients_(12, mesh.tet_count()) {
  for (int e = 0; e < tet_count(); ++e) {
    const Eigen::Matrix3d edges = edge_matrix(mesh.nodes, tets_.col(e));
    // Rows of edges^-1 are the gradients of N_1..N_3; by cross products they keep their relative
    // accuracy in slivers.
    const double determinant = six_volumes(edges);
    LIMBER_DEMAND(determinant > 0);
    volumes_[e] = determinant / 6;
    Eigen::Map<Eigen::Matrix<double, 3, 4>> gradients(shape_gradients_.col(e).data());
    gradients.col(1) = edges.col(1).cross(edges.col(2)) / determinant;
    gradients.col(2) = edges.col(2).cross(edges.col(0)) / determinant;
    gradients.col(3) = edges.col(0).cross(edges.col(1)) / determinant;
    gradients.col(0) = -(gradients.col(1) + gradients.col(2) + gradients.col(3));
  }
}

Eigen::Matrix3d GradientOperator::apply(const Eigen::Ref<const Eigen::VectorXd>& u, int tet) const {
  // Differences against corner 0 first: rigid translations cancel exactly, at any size.
  const ShapeGradients gradients = shape_gradients(tet);
  const Eigen::Vector3d origin = u.segment<3>(3 * tets_(0, tet));
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (int a = 1; a < 4; ++a) {
    result += (u.segment<3>(3 * tets_(a, tet)) - origin) * gradients.col(a).transpose();
  }
  return result;
}

void GradientOperator::apply(const Eigen::Ref<const Eigen::VectorXd>& u, Eigen::VectorXd& g) const {
  LIMBER_DEMAND(u.size() == 3 * node_count_);
  g.resize(9 * tet_count());
  parallel_for(tet_count(), kTetsPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (auto e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
      Eigen::Map<Eigen::Matrix3d>(g.data() + 9 * e) = apply(u, e);
    }
  });
}

void GradientOperator::apply_transposed_weighted(const Eigen::Ref<const Eigen::VectorXd>& g,
                                                 Eigen::VectorXd& f) const {
  LIMBER_DEMAND(g.size() == 9 * tet_count());
  f.setZero(3 * node_count_);
  for (int e = 0; e < tet_count(); ++e) {
    const Eigen::Matrix<double, 3, 4> force =
        volumes_[e] * Eigen::Map<const Eigen::Matrix3d>(g.data() + 9 * e) * shape_gradients(e);
    for (int a = 0; a < 4; ++a) f.segment<3>(3 * tets_(a, e)) += force.col(a);
  }
}

Eigen::SparseMatrix<double> GradientOperator::matrix() const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(tet_count()) * 36);
  for (int e = 0; e < tet_count(); ++e) {
    const ShapeGradients gradients = shape_gradients(e);
    for (int a = 0; a < 4; ++a) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
          entries.emplace_back(9 * e + 3 * j + i, 3 * tets_(a, e) + i, gradients(j, a));
        }
      }
    }
  }
  Eigen::SparseMatrix<double> result(9 * tet_count(), 3 * node_count_);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

Eigen::SparseMatrix<double> GradientOperator::scalar_laplacian() const {
  const NodeGraph graph(tets_, node_count_);
  return graph.assemble_scalar([&](int e) -> Eigen::Matrix4d {
    const ShapeGradients gradients = shape_gradients(e);
    return volumes_[e] * gradients.transpose() * gradients;
  });
}

}  // namespace limber::bodies
