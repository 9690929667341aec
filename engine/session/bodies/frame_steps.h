#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"

namespace limber::session {

/// Largest distance that a node moves from one frame to the next [m]; 0 for fewer than two frames.
/// @param basis  B, 3n x h
/// @param coordinates  q, h x N
/// @throws Error{kCancelled}
[[nodiscard]] double largest_frame_step(const Eigen::MatrixXd& basis,
                                        const Eigen::MatrixXf& coordinates, const JobContext& job);

struct FarthestMove {
  double distance = 0;  // [m]
  int frame = 0;
};

/// Largest distance of a node from the mean of its places one frame before and one after, and that
/// frame; nothing for fewer than three frames. Parameters and errors as above.
[[nodiscard]] FarthestMove zigzag(const Eigen::MatrixXd& basis, const Eigen::MatrixXf& coordinates,
                                  const JobContext& job);

/// A cycle between its last frame and its first one, h x (N + 2).
[[nodiscard]] Eigen::MatrixXf around_seam(const Eigen::MatrixXf& coordinates);

/// Largest distance of a node from rest, and its frame. Parameters and errors as above.
[[nodiscard]] FarthestMove farthest_from_rest(const Eigen::MatrixXd& basis,
                                              const Eigen::MatrixXf& coordinates,
                                              const JobContext& job);

/// The rows of B of every so many nodes, at most `most` of them.
[[nodiscard]] Eigen::MatrixXd rows_of_some_nodes(const Eigen::MatrixXd& basis, int most);

}  // namespace limber::session
