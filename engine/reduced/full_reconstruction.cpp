#include "engine/reduced/full_reconstruction.h"

#include <Eigen/Geometry>
#include <algorithm>
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
constexpr int kGroup = 2 * kPack;  // poses
static_assert(kGroup % Pack<float>::size() == 0);
constexpr int kSolveColumns = 3 * kGroup;  // right-hand sides of one solve: three axes of a group

/// Pairs of modes that one pass over the tets takes along.
constexpr int kPairs = 64;

/// Parts of a linear displacement in one tet: rotation vector, and half the rotation W with the
/// strain.
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
  template <class V, class T>
  void add_forces(const T* v, T* f, int lanes, int offset) const {
    const auto load = [&](const T* from) {
      if constexpr (std::is_same_v<V, T>) {
        return *from;
      } else {
        return V(from, stdx::element_aligned);
      }
    };
    const auto store = [&](const V& value, T* to) {
      if constexpr (std::is_same_v<V, T>) {
        *to = value;
      } else {
        value.copy_to(to, stdx::element_aligned);
      }
    };
    const auto& tets = gradient.tets();
    for (int e = 0; e < gradient.tet_count(); ++e) {
      const Eigen::Matrix<T, 3, 4> shape = gradient.shape_gradients(e).template cast<T>();
      const T* from[4];
      T* to[4];
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
      // Rounded once it is an area: volumes of small units are beyond single precision.
      const Eigen::Matrix<T, 3, 4> area =
          (gradient.volumes()[e] * gradient.shape_gradients(e)).template cast<T>();
      for (int i = 0; i < 3; ++i) {
        V sum = V(T(0));
        for (int a = 1; a < 4; ++a) {
          const V force = g[i] * area(0, a) + g[3 + i] * area(1, a) + g[6 + i] * area(2, a);
          sum += force;
          store(load(to[a] + i * lanes) + force, to[a] + i * lanes);
        }
        store(load(to[0] + i * lanes) - sum, to[0] + i * lanes);
      }
    }
  }

  /// f of kGroup poses side by side, from zero.
  template <class T>
  void add_group_forces(const std::vector<T>& v, std::vector<T>& f, const JobContext& job) const {
    std::fill(f.begin(), f.end(), T(0));
    for (int offset = 0; offset < kGroup; offset += static_cast<int>(Pack<T>::size())) {
      job.throw_if_cancelled();
      add_forces<Pack<T>>(v.data(), f.data(), kGroup, offset);
    }
    job.throw_if_cancelled();
  }

  /// f of g'' along each of `count` pairs, side by side as above with kPairs lanes. With g = exp(W)
  /// (I + s) - I it is (W_i W_j + W_j W_i) / 2 + W_i s_j + W_j s_i.
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

  template <class T>
  using Matrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
  /// q += X^T f(v), forces in the precision of X.
  template <class T>
  void add_projections(const Matrix<T>& of_forces, const Eigen::Ref<const Eigen::MatrixXd>& v,
                       Eigen::MatrixXd& q, const JobContext& job) const;

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

Eigen::Matrix3Xd FullReconstruction::row_of(const Site& site) const {
  const bodies::GradientOperator& gradient = impl_->gradient;
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(gradient.node_count());
  for (std::size_t i = 0; i < site.nodes.size(); ++i) weight[site.nodes[i]] += site.weight(i);
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

namespace {

/// Poses first .. first + count - 1, side by side: entry row * kGroup + pose; others are zero.
template <class T>
void interleave(const Eigen::Ref<const Eigen::MatrixXd>& v, Eigen::Index first, Eigen::Index count,
                std::vector<T>& lanes) {
  for (Eigen::Index row = 0; row < v.rows(); ++row) {
    for (Eigen::Index p = 0; p < kGroup; ++p)
      lanes[row * kGroup + p] = p < count ? static_cast<T>(v(row, first + p)) : T(0);
  }
}

}  // namespace

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
      const Eigen::Index first = group * kGroup;
      const Eigen::Index count = std::min<Eigen::Index>(kGroup, v.cols() - first);
      interleave(v, first, count, lanes_v);
      impl_->add_group_forces(lanes_v, lanes_f, job);
      impl_->gather(lanes_f.data(), kGroup, rhs);
      impl_->laplacian.solve_in_place(rhs, workspace);
      for (Eigen::Index p = 0; p < count; ++p) {
        impl_->scatter(rhs.middleCols<3>(3 * p), v.col(first + p).data(), u.col(first + p));
      }
    }
  });
  return u;
}

template <class T>
void FullReconstruction::Impl::add_projections(const Matrix<T>& of_forces,
                                               const Eigen::Ref<const Eigen::MatrixXd>& v,
                                               Eigen::MatrixXd& q, const JobContext& job) const {
  constexpr Eigen::Index kPoses = 32;  // whose forces are there at once: one product
  parallel_for((v.cols() + kPoses - 1) / kPoses, 1, [&](std::int64_t block, std::int64_t) {
    const Eigen::Index start = block * kPoses, poses = std::min(kPoses, v.cols() - start);
    std::vector<T> lanes_v(v.rows() * kGroup), lanes_f(v.rows() * kGroup);
    Matrix<T> f(v.rows(), poses);
    for (Eigen::Index first = 0; first < poses; first += kGroup) {
      const Eigen::Index count = std::min<Eigen::Index>(kGroup, poses - first);
      interleave(v, start + first, count, lanes_v);
      add_group_forces(lanes_v, lanes_f, job);
      for (Eigen::Index row = 0; row < v.rows(); ++row) {
        for (Eigen::Index p = 0; p < count; ++p) f(row, first + p) = lanes_f[row * kGroup + p];
      }
    }
    q.middleCols(start, poses) += (of_forces.transpose() * f).template cast<double>();
  });
}

Eigen::MatrixXd FullReconstruction::project_linear(const Adjoint& adjoint,
                                                   const Eigen::Ref<const Eigen::MatrixXd>& v,
                                                   Precision precision,
                                                   const JobContext& job) const {
  LIMBER_DEMAND(v.rows() == adjoint.of_forces.rows());
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(adjoint.of_forces.cols(), v.cols());
  if (adjoint.of_displacements.size() > 0) q.noalias() = adjoint.of_displacements.transpose() * v;
  if (precision == Precision::kSingle) {
    impl_->add_projections<float>(adjoint.of_forces.cast<float>(), v, q, job);
  } else {
    impl_->add_projections<double>(adjoint.of_forces, v, q, job);
  }
  return q;
}

FullReconstruction::Adjoint FullReconstruction::adjoint(const Eigen::MatrixXd& basis) const {
  const Eigen::Index rows = 3 * Eigen::Index{impl_->gradient.node_count()};
  const Eigen::VectorXd& share = impl_->mass_share;
  LIMBER_DEMAND(basis.rows() == rows);
  Adjoint result;
  Eigen::MatrixXd loads = basis;
  if (share.size() > 0) {
    // u = u_0 - mean(u_0) + mean(v), means weighted by mass.
    result.of_displacements.resize(rows, basis.cols());
    for (Eigen::Index k = 0; k < basis.cols(); ++k) {
      const Eigen::Map<const Eigen::Matrix3Xd> nodes(basis.col(k).data(), 3, share.size());
      const Eigen::Vector3d sum = nodes.rowwise().sum();
      Eigen::Map<Eigen::Matrix3Xd>(result.of_displacements.col(k).data(), 3, share.size()) =
          sum * share.transpose();
    }
    loads -= result.of_displacements;
  }
  Eigen::MatrixXd rhs(impl_->dofs.free_count(), 3 * basis.cols());
  for (Eigen::Index k = 0; k < basis.cols(); ++k)
    impl_->gather(loads.col(k).data(), 1, rhs.middleCols<3>(3 * k));
  impl_->laplacian.solve_in_place(rhs);
  result.of_forces.setZero(rows, basis.cols());
  const std::vector<int>& nodes = impl_->dofs.full_of_free();
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        result.of_forces(3 * nodes[i] + axis, k) = rhs(static_cast<Eigen::Index>(i), 3 * k + axis);
      }
    }
  }
  return result;
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

Eigen::MatrixXd FullReconstruction::lift(const Eigen::Ref<const Eigen::MatrixXd>& base,
                                         const std::vector<int>& fixed_nodes) const {
  const bool moves = std::any_of(fixed_nodes.begin(), fixed_nodes.end(), [&](int node) {
    return !base.middleRows<3>(3 * Eigen::Index{node}).isZero(0);
  });
  if (!moves) return {};
  // From its own gradients a displacement comes back without what its pins do.
  Eigen::MatrixXd lift(base.rows(), base.cols());
  Eigen::VectorXd gradients;
  for (Eigen::Index frame = 0; frame < base.cols(); ++frame) {
    gradient().apply(base.col(frame), gradients);
    lift.col(frame) = base.col(frame) - from_gradients(gradients);
  }
  return lift;
}

}  // namespace limber::reduced
