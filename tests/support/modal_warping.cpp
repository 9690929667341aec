// Choi and Ko 2005, Modal warping: real-time simulation of large rotational deformation and
// manipulation; sections 3.2 (rotation of the nodes, psi) and 3.3 (its integral along the path).
#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/rotations/exponential_coefficients.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/reduced/base_frames.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/site_list.h"
#include "tests/support/reconstruction.h"

namespace limber::reduced {
namespace {

/// int_0^1 exp(t w^x) dt = I + a w^x + b (w^x)^2, and the derivatives of a, b by n = |w|, over n.
struct MeanRotation {
  double a, b;              // (1 - cos n) / n^2, (n - sin n) / n^3
  double a_slope, b_slope;  // over n

  explicit MeanRotation(const Eigen::Vector3d& w) {
    const double n2 = w.squaredNorm();
    const auto k = rotations::exponential_coefficients(n2);
    a = k.cosine;
    a_slope = k.cosine_derivative;
    if (n2 > 1) {
      b = (1 - k.sine) / n2;
      b_slope = -(k.sine_derivative + 2 * b) / n2;
      return;
    }
    // The closed forms cancel: sum of (-1)^k n^(2k) / (2k + 3)! and of its derivative.
    b = b_slope = 0;
    double term = 1.0 / 6;
    for (int j = 0; j < 10; ++j) {
      b += term;
      const double next = -term / ((2 * j + 4) * (2 * j + 5));
      b_slope += 2 * (j + 1) * next;
      term = next * n2;
    }
  }

  [[nodiscard]] Eigen::Vector3d apply(const Eigen::Vector3d& w, const Eigen::Vector3d& v) const {
    const Eigen::Vector3d turn = w.cross(v);
    return v + a * turn + b * w.cross(turn);
  }
  [[nodiscard]] Eigen::Matrix3d matrix(const Eigen::Vector3d& w) const {
    const Eigen::Matrix3d cross = rotations::cross_matrix(w);
    return Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
  }
  /// d apply(w, v) / d w.
  [[nodiscard]] Eigen::Matrix3d slope(const Eigen::Vector3d& w, const Eigen::Vector3d& v) const {
    const Eigen::Vector3d turn = w.cross(v);
    const Eigen::Vector3d along = a_slope * turn + b_slope * w.cross(turn);
    return along * w.transpose() - a * rotations::cross_matrix(v) -
           b * (rotations::cross_matrix(turn) +
                rotations::cross_matrix(w) * rotations::cross_matrix(v));
  }
};

/// Psi, 3n x R: rotation vectors of the nodes per mode [rad].
Eigen::MatrixXd nodal_rotations(const bodies::ElasticBody& body, const Eigen::MatrixXd& modes) {
  const bodies::GradientOperator gradient(body.mesh);
  const int nodes = body.mesh.node_count();
  Eigen::VectorXd volume = Eigen::VectorXd::Zero(nodes);
  for (int e = 0; e < gradient.tet_count(); ++e) {
    for (int a = 0; a < 4; ++a) volume[gradient.tets()(a, e)] += gradient.volumes()[e];
  }
  Eigen::MatrixXd psi = Eigen::MatrixXd::Zero(modes.rows(), modes.cols());
  parallel_for(modes.cols(), 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t k = begin; k < end; ++k) {
      for (int e = 0; e < gradient.tet_count(); ++e) {
        const Eigen::Vector3d theta = rs_of_gradient(gradient.apply(modes.col(k), e)).head<3>();
        for (int a = 0; a < 4; ++a) {
          const int node = gradient.tets()(a, e);
          psi.col(k).segment<3>(3 * node) += gradient.volumes()[e] / volume[node] * theta;
        }
      }
    }
  });
  return psi;
}

class WarpedReconstruction final : public Reconstruction {
 public:
  WarpedReconstruction(const bodies::ElasticBody& body, const ScaledModes& modes,
                       const Eigen::MatrixXd& base)
      : modes_(modes.modes),
        rotations_(nodal_rotations(body, modes.modes)),
        // A translation is not turned by the rotation that comes with it.
        straight_(modes.rigid_count / 2),
        length_(body.length()),
        base_(base, body.mesh.node_count()),
        sites_(body.mesh.node_count()) {}

  SiteId add_site(const std::vector<int>& nodes) override { return sites_.add(nodes).id; }
  [[nodiscard]] int coordinate_count() const override { return static_cast<int>(modes_.cols()); }
  [[nodiscard]] double length() const override { return length_; }
  [[nodiscard]] bool moves(SiteId site) const override {
    sites_.check(site);
    for (const int node : sites_.nodes(site)) {
      if (!modes_.middleRows<3>(3 * Eigen::Index{node}).isZero(0)) return true;
    }
    return false;
  }

  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    LIMBER_DEMAND(z.rows() == modes_.cols());
    sites_.check(queries, z.cols());
    base_.check(frames);
    const auto count = static_cast<Eigen::Index>(queries.size());
    u.setZero(3, count);
    if (jacobian != nullptr) jacobian->setZero(3 * count, modes_.cols());
    for (Eigen::Index i = 0; i < count; ++i) {
      const SiteQuery& query = queries[i];
      const std::vector<int>& nodes = sites_.nodes(query.site);
      const double share = 1 / static_cast<double>(nodes.size());
      for (const int node : nodes) {
        u.col(i) += share * displacement(node, z.col(query.column));
        if (jacobian != nullptr)
          add_jacobian(node, z.col(query.column), share, jacobian->middleRows<3>(3 * i));
      }
      if (base_.any()) u.col(i) += base_.mean(nodes, frames[query.column]);
    }
  }

  [[nodiscard]] Eigen::MatrixXd displacements(
      int first, const Eigen::Ref<const Eigen::MatrixXd>& z) const override {
    LIMBER_DEMAND(z.rows() == modes_.cols());
    const Eigen::Index turned = modes_.cols() - straight_;
    Eigen::MatrixXd u = modes_.rightCols(turned) * z.bottomRows(turned);
    const Eigen::MatrixXd w = rotations_ * z;
    const Eigen::MatrixXd shift = modes_.leftCols(straight_) * z.topRows(straight_);
    parallel_for(u.cols(), 8, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t frame = begin; frame < end; ++frame) {
        for (Eigen::Index row = 0; row < u.rows(); row += 3) {
          const Eigen::Vector3d at = w.col(frame).segment<3>(row);
          u.col(frame).segment<3>(row) = MeanRotation(at).apply(at, u.col(frame).segment<3>(row)) +
                                         shift.col(frame).segment<3>(row);
        }
      }
    });
    base_.add_to(first, u);
    return u;
  }

 private:
  using Rows = Eigen::Ref<Eigen::MatrixXd>;

  [[nodiscard]] Eigen::Vector3d linear(int node, const Eigen::Ref<const Eigen::VectorXd>& z) const {
    const Eigen::Index turned = modes_.cols() - straight_;
    return modes_.block(3 * Eigen::Index{node}, straight_, 3, turned) * z.tail(turned);
  }
  [[nodiscard]] Eigen::Vector3d displacement(int node,
                                             const Eigen::Ref<const Eigen::VectorXd>& z) const {
    const Eigen::Vector3d w = rotations_.middleRows<3>(3 * Eigen::Index{node}) * z;
    const auto shift = modes_.block(3 * Eigen::Index{node}, 0, 3, straight_);
    return MeanRotation(w).apply(w, linear(node, z)) + shift * z.head(straight_);
  }
  void add_jacobian(int node, const Eigen::Ref<const Eigen::VectorXd>& z, double share,
                    Rows out) const {
    const auto psi = rotations_.middleRows<3>(3 * Eigen::Index{node});
    const Eigen::Vector3d w = psi * z;
    const MeanRotation mean(w);
    const Eigen::Index turned = modes_.cols() - straight_;
    const auto rows = modes_.middleRows<3>(3 * Eigen::Index{node});
    out += share * mean.slope(w, linear(node, z)) * psi;
    out.rightCols(turned) += share * mean.matrix(w) * rows.rightCols(turned);
    out.leftCols(straight_) += share * rows.leftCols(straight_);
  }

  Eigen::MatrixXd modes_;
  Eigen::MatrixXd rotations_;  // Psi, 3n x R
  Eigen::Index straight_;      // leading columns that are translations
  double length_;
  BaseFrames base_;
  SiteList sites_;
};

}  // namespace

std::unique_ptr<Reconstruction> make_warped_reconstruction(const bodies::ElasticBody& body,
                                                           const ScaledModes& modes,
                                                           const Eigen::MatrixXd& base) {
  return std::make_unique<WarpedReconstruction>(body, modes, base);
}

}  // namespace limber::reduced
