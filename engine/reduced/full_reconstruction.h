#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/modal_derivatives.h"
#include "engine/reduced/site.h"

namespace limber::reduced {

/// The map from RS coordinates back to displacements without any reduction (paper: space-time
/// editing, eq. 6, 7):
///   A u = G^T V g(y),  A = G^T V G,
/// with fixed nodes at zero. A is one scalar Laplacian on each axis, factored once. A free body's
/// displacement is known up to a translation. It gets the mass-weighted mean displacement of its
/// linear field (zero if only y or g is given), so that its centre of mass moves as the linear one
/// does.
class FullReconstruction {
 public:
  explicit FullReconstruction(const bodies::ElasticBody& body);
  ~FullReconstruction();
  FullReconstruction(FullReconstruction&&) noexcept;
  FullReconstruction& operator=(FullReconstruction&&) noexcept;

  [[nodiscard]] const bodies::GradientOperator& gradient() const;

  /// u (3n) whose gradient is nearest to g (9m, column-major per tet) in the volume-weighted norm.
  [[nodiscard]] Eigen::VectorXd from_gradients(const Eigen::Ref<const Eigen::VectorXd>& g) const;

  /// u of RS coordinates y (9m x k), pose by pose.
  [[nodiscard]] Eigen::MatrixXd from_coordinates(const Eigen::Ref<const Eigen::MatrixXd>& y) const;
  /// The contribution of moving pins to every reconstruction, which holds fixed nodes at rest. It
  /// is the field of least gradient with the displacements of fixed nodes in `base` (3n x N), or
  /// empty if these do not move.
  /// @param fixed_nodes  of the body
  [[nodiscard]] Eigen::MatrixXd lift(const Eigen::Ref<const Eigen::MatrixXd>& base,
                                     const std::vector<int>& fixed_nodes) const;

  /// u of y = Q v for linear displacements v (3n x k), as W z: many poses at once, on all threads.
  [[nodiscard]] Eigen::MatrixXd from_linear(const Eigen::Ref<const Eigen::MatrixXd>& v,
                                            const JobContext& job = {}) const;

  /// B^T u of reconstructions u, without their solves. A is symmetric, so it is (A^-1 B)^T f with f
  /// = G^T V g(y), plus the part of the mean displacement for a free body.
  struct Adjoint {
    Eigen::MatrixXd of_forces;         // A^-1 B, 3n x h
    Eigen::MatrixXd of_displacements;  // 3n x h, on v itself; empty for a held body
  };
  [[nodiscard]] Adjoint adjoint(const Eigen::MatrixXd& basis) const;
  enum class Precision { kDouble, kSingle };  // kSingle: relative errors of about 1e-6
  /// B^T from_linear(v), h x k.
  [[nodiscard]] Eigen::MatrixXd project_linear(const Adjoint& adjoint,
                                               const Eigen::Ref<const Eigen::MatrixXd>& v,
                                               Precision precision,
                                               const JobContext& job = {}) const;

  /// Second derivatives at v = 0 of from_linear along pairs of columns of `modes` (3n x R):
  ///   A u_ij = G^T V d2g(0)[Q w_i, Q w_j],
  /// one column per pair, symmetric in i and j. The quadratic part of every reconstruction is a sum
  /// of them.
  [[nodiscard]] Eigen::MatrixXd second_derivatives(const Eigen::Ref<const Eigen::MatrixXd>& modes,
                                                   const std::vector<bodies::ModePair>& pairs,
                                                   const JobContext& job = {}) const;

  /// The displacement of a site as a row on displacement gradients: sum over tets of g_e p_e (g_e 3
  /// x 3), p of 3 x m. For a free body it is relative to the centre of mass. One scalar solve,
  /// since A is symmetric and the same on each axis.
  [[nodiscard]] Eigen::Matrix3Xd row_of(const Site& site) const;
  /// n, shares of the mass that sum to one for a free body; else empty.
  [[nodiscard]] const Eigen::VectorXd& mass_share() const;

  /// One pose on the calling thread; `v` and `u` have 3n entries. For latency measurements and
  /// single frames.
  void from_linear(const Eigen::Ref<const Eigen::VectorXd>& v, Eigen::VectorXd& u) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::reduced
