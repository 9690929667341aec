#pragma once

#include <Eigen/Core>

#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// A body's dynamics, and the modes they act on as mixtures of the columns of W-hat (paper:
/// space-time editing, eq. 18).
struct Material {
  ModeDynamics dynamics;   // r
  Eigen::MatrixXd mixing;  // S, R x r

  [[nodiscard]] int modes() const { return static_cast<int>(mixing.cols()); }
  [[nodiscard]] int coordinates() const { return static_cast<int>(mixing.rows()); }
};

/// S = (I, 0)^T, R x r.
[[nodiscard]] Eigen::MatrixXd first_coordinates(int coordinates, int modes);
[[nodiscard]] bool are_first_coordinates(const Eigen::MatrixXd& mixing);

/// E_s = sum_k (|s_k|^2 - 1)^2 (eq. 20), without mu.
[[nodiscard]] double column_energy(const Eigen::Ref<const Eigen::MatrixXd>& mixing);

/// d E_s / d S, R x r.
[[nodiscard]] Eigen::MatrixXd column_gradient(const Eigen::Ref<const Eigen::MatrixXd>& mixing);

/// E_f of a whole motion z, r x N (eq. 17a, or as the dynamics say: ForceRows).
[[nodiscard]] double force_energy(const ModeDynamics& dynamics,
                                  const Eigen::Ref<const Eigen::MatrixXd>& motion,
                                  Beginning beginning = Beginning::kFromRest);

/// E_f as if every column of S had unit norm, with row k of z scaled to match. Then u, frequencies
/// and damping are the same, so energies of different S can be compared.
[[nodiscard]] double unit_force_energy(const Material& material,
                                       const Eigen::Ref<const Eigen::MatrixXd>& motion,
                                       Beginning beginning = Beginning::kFromRest);

/// Undamped frequency s [1/frame] of an oscillator of this stiffness [1/frame^2]. For differences
/// lambda = 2 - 2 cos(2 pi s), and s = 1/2, the Nyquist frequency, from lambda = 4 on. For sampled
/// modes lambda = (2 pi s)^2.
[[nodiscard]] double frequency_of(double stiffness,
                                  Discretisation discretisation = Discretisation::kDifferences);
/// The inverse, for 0 <= frequency, of differences <= 1/2.
[[nodiscard]] double stiffness_of(double frequency,
                                  Discretisation discretisation = Discretisation::kDifferences);

/// Free swing of a mode. For differences it is that of the shown frames. It follows from the roots
/// of (1 + d) x^2 - (2 + d - lambda) x + 1 = 0, the recurrence of E_f = 0 (eq. 17a). For sampled
/// modes it is the one in time: omega = sqrt(lambda), d = 2 zeta omega.
struct ModeResponse {
  double frequency_hz = 0;   // undamped; with differences at most half the frames a second
  double damping_ratio = 0;  // of critical; above 1 the mode creeps back without a swing
  double decay_per_s = 0;    // of the amplitude, of its slower part above critical damping [1/s]
};
[[nodiscard]] ModeResponse mode_response(
    double stiffness, double damping, double frames_per_second,
    Discretisation discretisation = Discretisation::kDifferences);

/// Which unknowns a material optimisation moves.
enum class MaterialVariables {
  kMotion,             // z: forces only, the material as given
  kMotionAndDynamics,  // z, Lambda, D
  kAll,                // z, Lambda, D, S
};

}  // namespace limber::spacetime
