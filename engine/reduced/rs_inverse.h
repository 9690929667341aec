#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/bodies/elastic_body.h"
#include "engine/bodies/gradient_operator.h"

namespace limber::reduced {

/// State of the tets that is passed from one frame to the next.
struct RsTrack {
  // 3 x m [rad]: theta, or next to a full turn the axis so far times the angle about it, turns
  // counted. Empty before the first frame.
  Eigen::Matrix3Xd counted;
};

/// RS coordinates y of displacements u, such that g(y) = G u exactly: per tet a polar decomposition
/// and a logarithm.
///
/// A rotation has many logarithms, full turns about its axis apart. Branches are chosen so that
/// neighbours (over a face) and successive frames are near each other. Tets are settled one after
/// the other: always the one with the smallest step from a settled neighbour or from its own
/// previous frame. For example, a beam twisted by two turns has |theta| up to 4 pi at its end.
///
/// Next to a full turn the axis of the remaining rotation may point anywhere (a twisted bar's
/// sections also tilt), and no branch is near its neighbours. These tets take the nearest branch.
/// Instead of their own theta they pass on the previous axis and the angle of their rotation about
/// it (turns counted). Beyond them the turn is found again. The same in time: a free body that
/// spins and wobbles passes full turns as a whole.
class RsInverse {
 public:
  /// @param gradient  of body.mesh; kept by reference
  RsInverse(const bodies::ElasticBody& body, const bodies::GradientOperator& gradient);

  /// y (9m) of one pose u (3n). The branch starts at zero at the fixed nodes (a free body: at its
  /// least turned tet).
  [[nodiscard]] Eigen::VectorXd coordinates(const Eigen::Ref<const Eigen::VectorXd>& u) const;

  /// The same for the next frame of a motion, which may turn each tet by less than half a turn.
  /// @param track  of the frame before (of this body); is moved on to this frame. Empty: first
  /// frame
  [[nodiscard]] Eigen::VectorXd coordinates(const Eigen::Ref<const Eigen::VectorXd>& u,
                                            RsTrack& track) const;

 private:
  const bodies::GradientOperator& gradient_;
  std::vector<std::array<int, 4>> neighbours_;  // over face f, -1 at the surface
  std::vector<char> at_fixed_node_;
};

}  // namespace limber::reduced
