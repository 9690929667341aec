#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/bodies/elastic_body.h"
#include "engine/bodies/gradient_operator.h"

namespace limber::reduced {

/// RS coordinates y of displacements u, such that g(y) = G u exactly: per tet a polar decomposition
/// and a logarithm.
///
/// A rotation has many logarithms, full turns about its axis apart. Branches are chosen so that
/// neighbours (over a face) and successive frames are near each other: tets are settled one after
/// the other, always the one that needs the smallest step from a settled neighbour or from its own
/// previous frame. So a beam twisted by two turns has |theta| up to 4 pi at its end.
///
/// Next to a full turn the axis of what is left of it may point anywhere (a twisted bar's sections
/// also tilt), and no choice of branch is near its neighbours. Such tets take the nearest branch
/// there is but hand on, instead of their own theta, the angle counted on from tet to tet about
/// the axis so far; beyond them the turn is found again.
class RsInverse {
 public:
  /// @param gradient  of body.mesh; kept by reference
  RsInverse(const bodies::ElasticBody& body, const bodies::GradientOperator& gradient);

  /// y (9m) of one pose u (3n). The branch starts at zero at the fixed nodes (a free body: at its
  /// least turned tet).
  [[nodiscard]] Eigen::VectorXd coordinates(const Eigen::Ref<const Eigen::VectorXd>& u) const;

  /// The same for the frame after the one with coordinates `previous` (9m): continuous in time.
  [[nodiscard]] Eigen::VectorXd coordinates(const Eigen::Ref<const Eigen::VectorXd>& u,
                                            const Eigen::VectorXd& previous) const;

 private:
  Eigen::VectorXd settle(const Eigen::Ref<const Eigen::VectorXd>& u,
                         const Eigen::VectorXd* previous) const;

  const bodies::GradientOperator& gradient_;
  std::vector<std::array<int, 4>> neighbours_;  // over face f, -1 at the surface
  std::vector<char> at_fixed_node_;
};

}  // namespace limber::reduced
