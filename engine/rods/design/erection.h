#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/design/linkage_design.h"
#include "engine/rods/equilibrium/conditions.h"

namespace limber::rods {

/// How a linkage is opened from its flat shape to the one it was designed for. A flat linkage may
/// open to several branches, e.g. to either side of its plane: forces at its joints select one, and
/// are removed where it is open.
struct Erection {
  double flat_angle = 0, mean_angle = 0;  // mean opening angles where it begins and ends [rad]
  std::vector<JointLoad> push;            // empty: it opens to the designed shape by itself
  /// Root mean square distance of joints between the shape it leads to and the designed one, after
  /// the best rigid motion [length].
  double distance = 0;
  Eigen::Matrix3Xd flat, open;  // joints where it begins, for which the push is given, and ends
  /// Mean opening angles of the opening, from flat_angle to mean_angle [rad], and the moment on
  /// every joint that holds them: with the push, at the last one without [force length]. Moments >
  /// 0 open.
  std::vector<double> angles, moments;
  /// The joint that is held while the linkage is pushed, by its own pin or for that time. The load
  /// has the greatest components of force and moment that this takes, by magnitude. The push bends
  /// the linkage against it: held elsewhere, it may open to another branch.
  std::optional<JointLoad> support;
};

/// The push for a flat shape that lies elsewhere: turned as the rigid motion that brings the joints
/// of the flat shape next to it best. A linkage lies anywhere, and its push is of its own.
[[nodiscard]] std::vector<JointLoad> turned_push(const std::vector<JointLoad>& push,
                                                 const Eigen::Matrix3Xd& flat,
                                                 const Eigen::Matrix3Xd& joints);

/// Conditions to be reached one after the other: the push alone, opened with the push, and `to`. A
/// linkage of which no pin holds a joint's motion is held at a joint while it is pushed.
/// @param support  that joint; empty: the middle one
[[nodiscard]] std::vector<Conditions> erection_stages(const LinkageState& flat,
                                                      const Conditions& to,
                                                      const std::vector<JointLoad>& push,
                                                      std::optional<int> support = {});

/// Root mean square distance of the joints of two shapes after the best rigid motion, which does
/// not mirror [length].
[[nodiscard]] double distance_between_shapes(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);
[[nodiscard]] double distance_between_shapes(const LinkageState& a, const LinkageState& b);

/// The same to the mirror image of b.
[[nodiscard]] double distance_to_mirror_image(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

struct ErectionSearch {
  std::optional<Erection> found;
  /// Why nothing was found, or looked for: the deployed shape may have no mean angle that it is
  /// opened to.
  std::string message;
};

/// Opens the flat shape of a design to the mean angle of the deployed one. The first attempt has no
/// push, unless the shape lies in a plane, where rounding would select a side. Later ones push with
/// forces out of its plane, proportional to the deployed shape's heights over it. Together these
/// are about the weight of rods that sag under it by their length (E I/L^2), then four and sixteen
/// times as much. An opening is accepted if it ends at the deployed shape within 1e-4 of the
/// linkage's extent, in two step sizes. Takes up to eight deployments, and begins no other after
/// 4000 Newton steps.
/// @param model  with the point's sizes
/// @throws Error{kCancelled}
[[nodiscard]] ErectionSearch find_erection(const LinkageModel& model, const Conditions& flat,
                                           const Conditions& deployed, const DesignPoint& point,
                                           const JobContext& job = {});

}  // namespace limber::rods
