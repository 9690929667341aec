#pragma once

#include <Eigen/Core>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"

namespace limber::spacetime {

/// A step in z at the kept frames and in S at once, and the multipliers that go with it.
struct MaterialStep {
  Lanes z;                 // lanes x kept
  Eigen::MatrixXd mixing;  // R x r
  Eigen::VectorXd m;       // rows
  double promise = 0;      // decrease of the undamped quadratic model
};

/// The point from which a step is taken.
struct MaterialPoint {
  Lanes z;                 // lanes x kept
  Eigen::MatrixXd mixing;  // S, R x r
  RowState rows;           // at S z; jacobian by z-hat = S z: padded R x terms
};

/// Gauss-Newton steps over (z, S) together, for the price of one in z: S too is seen only through
/// the constraints' rows, du_a = J_a (S dz_a + dS z_a). P = K + proximal I is that of
/// ConstraintSpace. N_k = nu I + 8 mu s_k s_k^T holds Levenberg's nu on dS and the Gauss-Newton
/// curvature of mu E_s. One dense system in the multipliers remains:
///   C_ab = delta_ab / w_a + sum_k [ (J_a S)_k G_k(a,b) (J_b S)_k + z_ka z_kb J_a N_k^-1 J_b^T ],
/// summed for a velocity over its terms, each with the z of its knot. The first `held` coordinates
/// and modes are left out of S, so that rigid motions of a free body do not change.
class MaterialSpace {
 public:
  /// nu = infinity: z alone, S stays.
  struct Damping {
    double nu = 1;  // on |dS|^2 / 2, > 0
    double mu = 0;  // weight of E_s, >= 0
    int held = 0;   // first coordinates (and modes) that S leaves alone
  };

  void step(const ModeSystems& systems, const ConstraintRows& rows, const MaterialPoint& point,
            const Damping& damping, MaterialStep& step);
  /// The same factor for other residuals of the rows, forces of z and E_s taken as zero: what a
  /// step has missed to second order is taken back with it.
  void correct(const ModeSystems& systems, const ConstraintRows& rows,
               const Eigen::VectorXd& residual, MaterialStep& step);

 private:
  void factor(const ModeSystems& systems, const ConstraintRows& rows, const MaterialPoint& point,
              const Damping& damping);
  void back_substitute(const ModeSystems& systems, const ConstraintRows& rows, Lanes& force,
                       const Eigen::MatrixXd& mixing_force, MaterialStep& step);
  /// N_k^-1 on each column.
  void divide_mixing(Eigen::MatrixXd& columns) const;
  [[nodiscard]] double model_decrease(const ModeSystems& systems, const ConstraintRows& rows,
                                      const MaterialPoint& point, const MaterialStep& step);

  Damping damping_;
  Eigen::MatrixXd system_, hat_, free_hat_, mixing_, at_terms_, work_, weighted_;
  Lanes jacobian_, scaled_, lanes_work_;
  Eigen::VectorXd along_;   // rows
  Eigen::VectorXd shrink_;  // per mode: 8 mu / (nu + 8 mu |s|^2), Sherman-Morrison
};

}  // namespace limber::spacetime
