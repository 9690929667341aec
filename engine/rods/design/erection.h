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
};

/// Conditions to be reached one after the other: the push alone, opened with the push, and `to`. A
/// linkage of which no pin holds a joint's motion is held at its middle joint while it is pushed.
[[nodiscard]] std::vector<Conditions> erection_stages(const LinkageState& flat,
                                                      const Conditions& to,
                                                      const std::vector<JointLoad>& push);

/// Root mean square distance of the joints of two shapes after the best rigid motion, which does
/// not mirror [length].
[[nodiscard]] double distance_between_shapes(const LinkageState& a, const LinkageState& b);

struct ErectionSearch {
  std::optional<Erection> found;
  /// Why nothing was found, or looked for: the deployed shape may have no mean angle that it is
  /// opened to.
  std::string message;
};

/// Opens the flat shape of a design to the mean angle of the deployed one, at first without a push
/// (unless it lies in a plane, where rounding would select a side), then with forces out of its
/// plane that are proportional to the deployed shape's heights over it: together about the weight
/// of rods that sag under it by their length (E I/L^2), then four and sixteen times as much.
/// Accepted is what ends at the deployed shape within 1e-4 of the linkage's extent, opened in two
/// step sizes. Takes up to eight deployments, and begins no other after 4000 Newton steps.
/// @param model  with the point's sizes
/// @throws Error{kCancelled}
[[nodiscard]] ErectionSearch find_erection(const LinkageModel& model, const Conditions& flat,
                                           const Conditions& deployed, const DesignPoint& point,
                                           const JobContext& job = {});

}  // namespace limber::rods
