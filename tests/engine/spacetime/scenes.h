#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "engine/spacetime/problem.h"
#include "tests/support/chain_kinematics.h"

namespace limber::spacetime {

inline constexpr double kExact = PositionConstraint::kExact;

/// Modes as a beam has them: the first swings once in `period` frames, the others are stiffer;
/// Rayleigh-like damping.
inline ModeDynamics test_dynamics(int modes, double period, double damping_ratio) {
  ModeDynamics dynamics{Eigen::VectorXd(modes), Eigen::VectorXd(modes)};
  const double base = std::pow(2 * 3.141592653589793 / period, 2);
  for (int k = 0; k < modes; ++k) {
    const double waves = 1 + static_cast<double>(k) / 3;
    dynamics.stiffness[k] = base * waves * waves * waves;
    dynamics.damping[k] = 2 * damping_ratio * std::sqrt(dynamics.stiffness[k]);
  }
  return dynamics;
}

/// `count` constraints on sites of the outer half, in evenly spaced frames that the ends leave
/// free, with targets near places the body can reach: u at a random z of the given amplitude.
inline std::vector<PositionConstraint> test_constraints(const testing::ChainKinematics& kinematics,
                                                        int count, const Timeline& timeline,
                                                        double amplitude, double weight,
                                                        unsigned seed) {
  std::mt19937_64 generator(seed);
  std::vector<PositionConstraint> constraints;
  for (int i = 0; i < count; ++i) {
    PositionConstraint constraint;
    constraint.id = static_cast<ConstraintId>(i + 1);
    constraint.frame = 2 + (timeline.frame_count - 5) * (i + 1) / (count + 1);
    constraint.site = kinematics.site_count() - 1 - i % (kinematics.site_count() / 2);
    constraint.weight = weight;
    Eigen::MatrixXd z(kinematics.coordinate_count(), 1);
    for (Eigen::Index k = 0; k < z.rows(); ++k) z(k, 0) = amplitude * testing::uniform(generator);
    Eigen::Matrix3Xd u;
    const int frame = constraint.frame;
    const reduced::SiteQuery query{constraint.site, 0};
    kinematics.evaluate({&frame, 1}, z, {&query, 1}, u, nullptr);
    constraint.target = u.col(0);
    constraints.push_back(constraint);
  }
  return constraints;
}

/// gamma-weighted E_c of soft positions, by its definition.
inline double soft_energy(const testing::ChainKinematics& kinematics,
                          const std::vector<PositionConstraint>& constraints,
                          const Eigen::MatrixXd& z) {
  double energy = 0;
  for (const PositionConstraint& constraint : constraints) {
    Eigen::Matrix3Xd u;
    const int frame = 0;
    const reduced::SiteQuery query{constraint.site, 0};
    kinematics.evaluate({&frame, 1}, z.col(constraint.frame), {&query, 1}, u, nullptr);
    energy += 0.5 * constraint.weight *
              ((u.col(0) - constraint.target) / kinematics.length()).squaredNorm();
  }
  return energy;
}

}  // namespace limber::spacetime
