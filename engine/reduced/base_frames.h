#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace limber::reduced {

/// The displacements of a base motion, or none.
class BaseFrames {
 public:
  /// @param displacements  3n x N [m], or empty
  /// @throws Error{kInvalidArgument} for another number of rows or numbers that are not finite
  BaseFrames(Eigen::MatrixXd displacements, int node_count);

  [[nodiscard]] bool any() const { return displacements_.cols() > 0; }
  [[nodiscard]] const Eigen::MatrixXd& displacements() const { return displacements_; }
  /// @throws Error{kOutOfRange} for a frame that the base motion has not
  void check(std::span<const int> frames) const;
  void check(int first, Eigen::Index count) const;
  /// Mean displacement of nodes in a frame; zero without a base motion.
  [[nodiscard]] Eigen::Vector3d mean(const std::vector<int>& nodes, int frame) const;
  /// u (3n x k) += frames first .. first + k - 1.
  void add_to(int first, Eigen::MatrixXd& u) const;

 private:
  Eigen::MatrixXd displacements_;
};

}  // namespace limber::reduced
