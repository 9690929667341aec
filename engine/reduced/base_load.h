#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"

namespace limber::reduced {

/// How the inertia of a body that is carried along acts on its modes. In frame i mode k is
/// accelerated by -(sum over nodes of m W_k . R^T a) / mass_k: a the acceleration of the base
/// there, R its rotation, from the frames before and after (complementary dynamics: the forces that
/// the animation does not have).
struct BaseLoad {
  Eigen::MatrixXd forces;  // R x N: -W^T M R^T a [kg m^2 / frame^2]; zero for rigid unknowns
  Eigen::VectorXd masses;  // R: of z^2, W_k^T M W_k [kg m^2]

  /// Accelerations of mixed modes, r x N [1/frame^2]. @param mixing  S, R x r
  [[nodiscard]] Eigen::MatrixXd of_modes(const Eigen::MatrixXd& mixing) const;
};

/// Makes the load of a base motion, frame by frame.
class BaseLoadSum {
 public:
  /// @param modes  W-hat, 3n x R [m]
  /// @param free_modes  the first ones, which have no stiffness: rigid unknowns and mechanisms
  /// @param displacements  of the base from rest, 3n x N [m], kept by reference; a cycle, the last
  /// frame before the first: other motions have no acceleration in their end frames
  BaseLoadSum(const bodies::ElasticBody& body, const Eigen::MatrixXd& modes, int free_modes,
              const Eigen::Ref<const Eigen::MatrixXd>& displacements);

  /// @param y  RS coordinates of the base in this frame, 9m: how its tets are turned
  void add(Eigen::Index frame, const Eigen::VectorXd& y);
  [[nodiscard]] const BaseLoad& load() const { return load_; }

 private:
  const bodies::TetMesh& mesh_;
  const Eigen::MatrixXd& modes_;
  int free_modes_;
  Eigen::Ref<const Eigen::MatrixXd> displacements_;
  Eigen::VectorXd corner_mass_;  // of each tet [kg]
  BaseLoad load_;
};

/// The load of all frames. @param modes, free_modes, displacements  as above
[[nodiscard]] BaseLoad base_load(const bodies::ElasticBody& body, const Eigen::MatrixXd& modes,
                                 int free_modes,
                                 const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                                 const JobContext& job = {});

}  // namespace limber::reduced
