#pragma once

#include <Eigen/Core>
#include <optional>

namespace limber::spacetime {

/// Share of a motion's power above half the Nyquist frequency, in [0, 1].
///
/// Power is the squared velocity v_i = x_(i+1) - x_i, summed over coordinates. Its spectrum is
/// Welch's. The velocities are cut into segments of L = min(kSpectrumSegment, N - 1) frames that
/// begin every L / 4 frames; the last one ends with the motion. Each is multiplied by the Hann
/// window sin^2(pi (n + 1/2) / L), then transformed (discrete Fourier transform). The share is the
/// power of all segments in bins above a quarter of a cycle a frame over their whole power.
///
/// Because of the window, a motion that begins or ends in full swing does not count as high
/// frequency. Its leakage into a bin at distance k falls like 1/k^6 (a swing of 8 frames a period,
/// L = 64: 1e-7). In return, a shake of the very first or last frames counts less.
/// @param coordinates  R x N: z-hat = S z, row k times the root mean square displacement of mode k
/// of W-hat, so that power is that of the nodes as far as displacements are linear. (In z-hat
/// itself, stiff modes would count far more than their displacements. W-hat scales modes with 1 /
/// sqrt(lambda).)
/// @returns nothing for fewer than kSpectrumMinFrames frames, whose bins are too wide to say; 0 for
/// a motion that stands still
/// @throws Error{kInvalidArgument} naming `coordinates` for numbers that are not finite
[[nodiscard]] std::optional<double> high_frequency_share(
    const Eigen::Ref<const Eigen::MatrixXd>& coordinates);
/// The same where row k still has to be multiplied by sizes[k], without a copy of the motion.
[[nodiscard]] std::optional<double> high_frequency_share(
    const Eigen::Ref<const Eigen::MatrixXd>& coordinates,
    const Eigen::Ref<const Eigen::VectorXd>& sizes);

/// Frames in a segment of the spectrum, and the fewest that have one.
constexpr int kSpectrumSegment = 64, kSpectrumMinFrames = 18;

}  // namespace limber::spacetime
