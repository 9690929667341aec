#include "engine/reduced/full_reconstruction.h"

#include <Eigen/Geometry>
#include <vector>

#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/base/parallel.h"
#include "engine/bodies/dof_map.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_kernel.h"

namespace limber::reduced {
namespace {

using rotations::Pack;
namespace stdx = rotations::stdx;

/// Poses that one pass over the tets takes along: two registers' worth.
constexpr int kPack = static_cast<int>(Pack<double>::size());
constexpr int kGroup = 2 * kPack;          // poses
constexpr int kSolveColumns = 3 * kGroup;  // right-hand sides of one solve: three axes of a group

/// Pairs of modes that one pass over the tets takes along.
constexpr int kPairs = 64;

/// Of a linear displacement in one tet: rotation vector, and half the rotation W with the strain.
struct LinearParts {
  Eigen::Vector3d rotation;
  Eigen::Matrix3d rest;
};

LinearParts linear_parts(const Eigen::Matrix3d& h) {
  const Eigen::Matrix3d w = (h - h.transpose()) / 2;
  return {{w(2, 1), w(0, 2), w(1, 0)}, h - w / 2};
}

bodies::DofMap free_nodes(const bodies::ElasticBody& body) {
  // A free body's Laplacian has the constants in its kernel: hold one node, shift afterwards.
  return bodies::DofMap::of_scalars(body.mesh.node_count(),
                                    body.is_free() ? std::vector<int>{0} : body.fixed_nodes);
}

}  // namespace

struct FullReconstruction::Impl {
  bodies::GradientOperator gradient;
  bodies::DofMap dofs;
  SparseCholesky laplacian;
  Eigen::VectorXd mass_share;  // n, sums to one; empty for a held body

  explicit Impl(const bodies::ElasticBody& body)
      : gradient(body.mesh),
        dofs(free_nodes(body)),
        laplacian(dofs.restrict_matrix(gradient.scalar_laplacian())) {
    if (body.is_free()) {
      mass_share = bodies::lumped_node_mass(body.mesh);
      mass_share /= mass_share.sum();
    }
  }

  /// f += G^T V g(Q v) with v and f of `lanes` poses side by side: entry (3 node + axis) * lanes +
  /// pose.
  template <class V>
  void add_forces(const double* v, double* f, int lanes, int offset) const {
    const auto load = [&](const double* from) {
      if constexpr (std::is_same_v<V, double>) {
        return *from;
      } else {
        return V(from, stdx::element_aligned);
      }
    };
    const auto store = [&](const V& value, double* to) {
      if constexpr (std::is_same_v<V, double>) {
        *to = value;
      } else {
        value.copy_to(to, stdx::element_aligned);
      }
    };
    const auto& tets = gradient.tets();
    for (int e = 0; e < gradient.tet_count(); ++e) {
      const auto shape = gradient.shape_gradients(e);
      const double* from[4];
      double* to[4];
      for (int a = 0; a < 4; ++a) {
        from[a] = v + std::ptrdiff_t{3} * tets(a, e) * lanes + offset;
        to[a] = f + std::ptrdiff_t{3} * tets(a, e) * lanes + offset;
      }
      V h[9], y[9], rotation[9], g[9];
      for (int i = 0; i < 3; ++i) {
        const V origin = load(from[0] + i * lanes);
        V edge[3];
        for (int a = 0; a < 3; ++a) edge[a] = load(from[a + 1] + i * lanes) - origin;
        for (int j = 0; j < 3; ++j) {
          h[3 * j + i] = edge[0] * shape(j, 1) + edge[1] * shape(j, 2) + edge[2] * shape(j, 3);
        }
      }
      rs_of_gradient_entries(h, y);
      rs_gradient_entries(y, rotation, g);
      const double volume = gradient.volumes()[e];
      for (int i = 0; i < 3; ++i) {
        V sum = V(0.0);
        for (int a = 1; a < 4; ++a) {
          const V force = g[i] * (volume * shape(0, a)) + g[3 + i] * (volume * shape(1, a)) +
                          g[6 + i] * (volume * shape(2, a));
          sum += force;
          store(load(to[a] + i * lanes) + force, to[a] + i * lanes);
        }
        store(load(to[0] + i * lanes) - sum, to[0] + i * lanes);
      }
    }
  }

  /// f of g'' along each of `count` pairs, side by side as above with kPairs lanes: with
  /// g = exp(W) (I + s) - I that is (W_i W_j + W_j W_i) / 2 + W_i s_j + W_j s_i.
  void second_forces(const Eigen::Ref<const Eigen::MatrixXd>& modes, const bodies::ModePair* pairs,
                     int count, std::vector<double>& f) const {
    std::vector<char> used(static_cast<std::size_t>(modes.cols()), 0);
    for (int i = 0; i < count; ++i) used[pairs[i].first] = used[pairs[i].second] = 1;
    std::vector<LinearParts> parts(used.size());
    Eigen::Matrix<double, kPairs, 9> second = Eigen::Matrix<double, kPairs, 9>::Zero();
    f.assign(static_cast<std::size_t>(modes.rows()) * kPairs, 0.0);
    using Lane = Eigen::Map<Eigen::Matrix<double, kPairs, 1>>;
    for (int e = 0; e < gradient.tet_count(); ++e) {
      for (std::size_t k = 0; k < used.size(); ++k) {
        if (used[k] != 0)
          parts[k] = linear_parts(gradient.apply(modes.col(static_cast<Eigen::Index>(k)), e));
      }
      for (int i = 0; i < count; ++i) {
        const LinearParts &a = parts[pairs[i].first], &b = parts[pairs[i].second];
        for (int j = 0; j < 3; ++j) {
          second.row(i).segment<3>(3 * j) =
              a.rotation.cross(b.rest.col(j)) + b.rotation.cross(a.rest.col(j));
        }
      }
      const auto shape = gradient.shape_gradients(e);
      for (int corner = 0; corner < 4; ++corner) {
        const Eigen::Vector3d weight = gradient.volumes()[e] * shape.col(corner);
        double* to = f.data() + std::ptrdiff_t{3} * gradient.tets()(corner, e) * kPairs;
        for (int axis = 0; axis < 3; ++axis) {
          Lane(to + axis * kPairs) += second.col(axis) * weight[0] +
                                      second.col(3 + axis) * weight[1] +
                                      second.col(6 + axis) * weight[2];
        }
      }
    }
  }

  /// Columns 3 pose + axis of the right-hand side over free nodes.
  void gather(const double* f, int lanes, Eigen::Ref<Eigen::MatrixXd> rhs) const {
    const std::vector<int>& nodes = dofs.full_of_free();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const double* row = f + (std::ptrdiff_t{3} * nodes[i] + axis) * lanes;
        for (int pose = 0; pose < lanes; ++pose)
          rhs(static_cast<Eigen::Index>(i), 3 * pose + axis) = row[pose];
      }
    }
  }

  /// u (3n) of one pose from its three solved columns; the centre of mass goes where `v` has it.
  void scatter(const Eigen::Ref<const Eigen::MatrixXd>& solution, const double* v,
               Eigen::Ref<Eigen::VectorXd> u) const {
    u.setZero();
    const std::vector<int>& nodes = dofs.full_of_free();
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        u[3 * nodes[i] + axis] = solution(static_cast<Eigen::Index>(i), axis);
      }
    }
    if (mass_share.size() == 0) return;
    Eigen::Map<Eigen::Matrix3Xd> nodes_u(u.data(), 3, mass_share.size());
    Eigen::Vector3d shift = -(nodes_u * mass_share);
    if (v != nullptr)
      shift += Eigen::Map<const Eigen::Matrix3Xd>(v, 3, mass_share.size()) * mass_share;
    nodes_u.colwise() += shift;
  }
};

FullReconstruction::FullReconstruction(const bodies::ElasticBody& body)
    : impl_(std::make_unique<Impl>(body)) {}
FullReconstruction::~FullReconstruction() = default;
FullReconstruction::FullReconstruction(FullReconstruction&&) noexcept = default;
FullReconstruction& FullReconstruction::operator=(FullReconstruction&&) noexcept = default;

const bodies::GradientOperator& FullReconstruction::gradient() const { return impl_->gradient; }

const Eigen::VectorXd& FullReconstruction::mass_share() const { return impl_->mass_share; }

Eigen::Matrix3Xd FullReconstruction::row_of(const std::vector<int>& nodes) const {
  const bodies::GradientOperator& gradient = impl_->gradient;
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(gradient.node_count());
  for (const int node : nodes) weight[node] += 1.0 / static_cast<double>(nodes.size());
  if (impl_->mass_share.size() > 0) weight -= impl_->mass_share;
  Eigen::MatrixXd x = impl_->dofs.restrict_rows(weight);
  impl_->laplacian.solve_in_place(x);
  const Eigen::VectorXd all = impl_->dofs.expand_rows(x);
  Eigen::Matrix3Xd row(3, gradient.tet_count());
  for (int e = 0; e < gradient.tet_count(); ++e) {
    row.col(e).setZero();
    for (int a = 0; a < 4; ++a)
      row.col(e) += gradient.shape_gradients(e).col(a) * all[gradient.tets()(a, e)];
    row.col(e) *= gradient.volumes()[e];
  }
  return row;
}

Eigen::VectorXd FullReconstruction::from_gradients(
    const Eigen::Ref<const Eigen::VectorXd>& g) const {
  Eigen::VectorXd f;
  impl_->gradient.apply_transposed_weighted(g, f);
  Eigen::MatrixXd rhs(impl_->dofs.free_count(), 3);
  impl_->gather(f.data(), 1, rhs);
  impl_->laplacian.solve_in_place(rhs);
  Eigen::VectorXd u(f.size());
  impl_->scatter(rhs, nullptr, u);
  return u;
}

Eigen::MatrixXd FullReconstruction::from_coordinates(
    const Eigen::Ref<const Eigen::MatrixXd>& y) const {
  LIMBER_DEMAND(y.rows() == kRsSize * impl_->gradient.tet_count());
  Eigen::MatrixXd u(3 * impl_->gradient.node_count(), y.cols());
  parallel_for(y.cols(), 1, [&](std::int64_t begin, std::int64_t end) {
    Eigen::VectorXd g(y.rows());
    for (std::int64_t k = begin; k < end; ++k) {
      for (int e = 0; e < impl_->gradient.tet_count(); ++e) {
        const RsVector y_e = y.col(k).segment<kRsSize>(kRsSize * e);
        Eigen::Map<Eigen::Matrix3d>(g.data() + kRsSize * e) = displacement_gradient(y_e);
      }
      u.col(k) = from_gradients(g);
    }
  });
  return u;
}

Eigen::MatrixXd FullReconstruction::from_linear(const Eigen::Ref<const Eigen::MatrixXd>& v,
                                                const JobContext& job) const {
  const Eigen::Index rows = 3 * Eigen::Index{impl_->gradient.node_count()};
  LIMBER_DEMAND(v.rows() == rows);
  Eigen::MatrixXd u(rows, v.cols());
  const std::int64_t groups = (v.cols() + kGroup - 1) / kGroup;
  parallel_for(groups, 1, [&](std::int64_t begin, std::int64_t end) {
    std::vector<double> lanes_v(rows * kGroup), lanes_f(rows * kGroup);
    Eigen::MatrixXd rhs(impl_->dofs.free_count(), kSolveColumns);
    SparseCholesky::Workspace workspace;
    for (std::int64_t group = begin; group < end; ++group) {
      job.throw_if_cancelled();
      const Eigen::Index first = group * kGroup;
      const Eigen::Index count = std::min<Eigen::Index>(kGroup, v.cols() - first);
      for (Eigen::Index row = 0; row < rows; ++row) {
        for (Eigen::Index p = 0; p < kGroup; ++p)
          lanes_v[row * kGroup + p] = p < count ? v(row, first + p) : 0.0;
      }
      std::fill(lanes_f.begin(), lanes_f.end(), 0.0);
      for (int offset = 0; offset < kGroup; offset += kPack) {
        job.throw_if_cancelled();
        impl_->add_forces<Pack<double>>(lanes_v.data(), lanes_f.data(), kGroup, offset);
      }
      job.throw_if_cancelled();
      impl_->gather(lanes_f.data(), kGroup, rhs);
      impl_->laplacian.solve_in_place(rhs, workspace);
      for (Eigen::Index p = 0; p < count; ++p) {
        impl_->scatter(rhs.middleCols<3>(3 * p), v.col(first + p).data(), u.col(first + p));
      }
    }
  });
  return u;
}

Eigen::MatrixXd FullReconstruction::second_derivatives(
    const Eigen::Ref<const Eigen::MatrixXd>& modes, const std::vector<bodies::ModePair>& pairs,
    const JobContext& job) const {
  const Eigen::Index rows = 3 * Eigen::Index{impl_->gradient.node_count()};
  LIMBER_DEMAND(modes.rows() == rows);
  const auto all = static_cast<int>(pairs.size());
  Eigen::MatrixXd u(rows, all);
  parallel_for((all + kPairs - 1) / kPairs, 1, [&](std::int64_t begin, std::int64_t end) {
    std::vector<double> f;
    Eigen::MatrixXd rhs(impl_->dofs.free_count(), 3 * kPairs);
    SparseCholesky::Workspace workspace;
    for (auto block = static_cast<int>(begin); block < end; ++block) {
      job.throw_if_cancelled();
      const int first = block * kPairs, count = std::min(kPairs, all - first);
      impl_->second_forces(modes, pairs.data() + first, count, f);
      impl_->gather(f.data(), kPairs, rhs);
      impl_->laplacian.solve_in_place(rhs, workspace);
      for (int i = 0; i < count; ++i)
        impl_->scatter(rhs.middleCols<3>(3 * i), nullptr, u.col(first + i));
    }
  });
  return u;
}

void FullReconstruction::from_linear(const Eigen::Ref<const Eigen::VectorXd>& v,
                                     Eigen::VectorXd& u) const {
  const Eigen::Index rows = 3 * Eigen::Index{impl_->gradient.node_count()};
  LIMBER_DEMAND(v.size() == rows);
  thread_local Eigen::VectorXd f;
  thread_local Eigen::MatrixXd rhs;
  thread_local SparseCholesky::Workspace workspace;
  f.setZero(rows);
  u.resize(rows);
  impl_->add_forces<double>(v.data(), f.data(), 1, 0);
  rhs.resize(impl_->dofs.free_count(), 3);
  impl_->gather(f.data(), 1, rhs);
  impl_->laplacian.solve_in_place(rhs, workspace);
  impl_->scatter(rhs, v.data(), u);
}

}  // namespace limber::reduced
