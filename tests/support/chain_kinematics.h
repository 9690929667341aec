#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "engine/reduced/kinematics.h"

namespace limber::testing {

/// A body small enough to be written down: a straight chain of links along x, each turned and
/// stretched by its own rotation-strain coordinates, u of a site = tip of the first `site + 1`
/// links - its rest place. As nonlinear as a bending beam (the rotations of the links add up along
/// the chain), with exact Jacobians.
class ChainKinematics final : public reduced::Kinematics {
 public:
  /// @param coordinates  R
  /// @param bend         scale of the rotations that a unit of z makes [rad] (whole chain)
  ChainKinematics(int coordinates, int links, double bend, double length, unsigned seed);

  [[nodiscard]] int coordinate_count() const override { return coordinates_; }
  [[nodiscard]] double length() const override { return length_; }
  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override;

  [[nodiscard]] int site_count() const { return links_; }

 private:
  int coordinates_, links_;
  double length_;
  Eigen::MatrixXd
      rotation_;  // 3 links x R: rotation vector of each link (all links before it included)
  Eigen::MatrixXd stretch_;  // links x R
};

/// u = M_site z + offset: everything can be checked with dense linear algebra.
class LinearKinematics final : public reduced::Kinematics {
 public:
  LinearKinematics(int coordinates, int sites, double length, unsigned seed);
  /// Three coordinates, one site: u = length * z.
  static LinearKinematics translation(double length);

  [[nodiscard]] int coordinate_count() const override { return static_cast<int>(maps_.cols()); }
  [[nodiscard]] double length() const override { return length_; }
  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override;

  [[nodiscard]] const Eigen::MatrixXd& maps() const { return maps_; }

 private:
  explicit LinearKinematics(double length) : length_(length) {}
  double length_;
  Eigen::MatrixXd maps_;  // 3 sites x R [m]
};

/// Uniform in [-1, 1], the same on every machine.
[[nodiscard]] inline double uniform(std::mt19937_64& generator) {
  return 2 * (static_cast<double>(generator() >> 11) * 0x1.0p-53) - 1;
}

}  // namespace limber::testing
