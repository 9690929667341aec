#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/rods/linkage/line_mesh.h"
#include "engine/rods/linkage/state_numbers.h"
#include "engine/rods/rod/length_weights.h"
#include "engine/rods/section/section.h"
#include "engine/scene/scene.h"

namespace limber::scene {

/// Joints are numbered from 0 in the order of their vertices (of valence 2 to 4), segments as the
/// edges of the line mesh.

/// The fixed degrees of freedom of a joint.
enum class Held { kMotion, kAngle, kMotionAndAngle };
struct JointPin {
  int joint = 0;
  Held held = Held::kMotionAndAngle;
  /// Target position of the joint [scene length unit], unless its angle alone is held; empty: its
  /// current position.
  std::optional<Eigen::Vector3d> position = {};
  bool operator==(const JointPin&) const = default;
};

/// An opening angle that a joint is to have.
struct JointAngle {
  int joint = 0;
  double angle = 0;  // [rad], in (-pi, pi)
  bool operator==(const JointAngle&) const = default;
};

/// A spring from a point of the linkage to a point in space.
struct LinkageTarget {
  std::uint64_t id = 0;                                // 0: to be numbered by the session
  int joint = -1;                                      // at a joint, or else
  int segment = -1;                                    // on a segment,
  double share = 0.5;                                  // at this share of its length, in [0, 1]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [scene length unit]
  double stiffness = 0;                                // [N/m], > 0
  bool operator==(const LinkageTarget&) const = default;
};

struct JointLoad {
  int joint = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // [N m]
  double torque = 0;                                 // [N m], opens the joint
  bool operator==(const JointLoad&) const = default;
};

/// Procedure to open a linkage from flat to its designed shape. Forces push it out of its plane
/// while it opens, since without them it may open to another branch. They are removed when it is
/// open.
struct LinkageErection {
  double mean_angle = 0;          // that it leads to [rad], in (-pi, pi)
  std::vector<JointLoad> push;    // at most one for each joint; empty: it opens by itself
  std::vector<double> path = {};  // mean opening angles [rad], from flat to mean_angle
  /// Root mean square distance of joints from the designed shape to which it leads, after the best
  /// rigid motion [scene length unit].
  double distance = 0;
  /// Joints of the flat shape that the push is given for, 3 x joints [scene length unit]: the push
  /// turns with the linkage. Empty: the linkage as drawn.
  Eigen::Matrix3Xd flat_positions = {};
  /// Joints of the resulting shape, at any position; empty: not known.
  Eigen::Matrix3Xd positions = {};
  /// One for each of `path`: the moment on every joint that holds that angle, with the push (for
  /// the last one without); > 0 opens [N m]. Empty: not known.
  std::vector<double> path_moments = {};
  /// The joint that is held while the linkage is pushed, with the greatest components of force and
  /// moment by magnitude. It is held for that time only if no pin holds a joint's motion; empty:
  /// the middle joint is held.
  std::optional<JointLoad> support = {};
  /// The reason why no procedure to open to the designed shape is known; the rest is empty then.
  std::string failure = {};
};

/// Conditions that act on a linkage; edits change only these.
struct LinkageConditions {
  std::vector<JointPin> pins;
  std::vector<JointAngle> angles;
  std::optional<double> mean_angle;  // of all joints [rad], in (-pi, pi)
  std::vector<LinkageTarget> targets;
  std::vector<JointLoad> loads;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // [m/s^2]
  /// Rest length of each segment, > 0 [scene length unit]; empty: as Linkage::rest_lengths says.
  /// Designs change them.
  Eigen::VectorXd segment_lengths = {};
  /// Rest length of each edge that a segment is computed with, > 0 [scene length unit]; empty: the
  /// lengths of segments apply. Lengths of segments are empty if these are given. First come the
  /// edges within segments, from start to finish, then for each joint that of its rod A and that of
  /// its rod B, if it has them.
  Eigen::VectorXd edge_lengths = {};
  /// Scale of each segment's section in both directions, > 0; empty: 1.
  Eigen::VectorXd section_scales = {};
  /// With these sizes of rods; null: not known.
  std::shared_ptr<const LinkageErection> erection = {};
};

/// Rest lengths of segments: those of the line mesh, or those for which the linkage as drawn has
/// least elastic energy (rods::solve_rest_lengths).
enum class RestLengthChoice { kAsDrawn, kLeastStress };

/// A rod linkage: plain values, lengths in `length_unit_in_metres`.
struct Linkage {
  std::string name;
  rods::LineMesh lines;
  double length_unit_in_metres = 1;
  double youngs_modulus = 10e9;  // [Pa]
  double poissons_ratio = 0.3;
  double density = 600;  // [kg/m^3]
  rods::Section section = rods::Rectangle{0.02, 0.005};
  rods::StiffAxis stiff_axis = rods::StiffAxis::kAsGiven;
  /// >= 3; of short segments fewer (rods::edges_by_length). 0: as many as `tolerance` takes under
  /// `conditions`, which then have no edge_lengths, and there is no shape.
  int edges_per_segment = 10;
  /// Positions are to be off by at most this share of the linkage's size (rods::drawn_extent) by
  /// its discretisation; in (0, 0.1]. 0: none is named.
  double tolerance = 0;
  rods::BendingForm bending = rods::kDefaultBending;
  RestLengthChoice rest_lengths = RestLengthChoice::kAsDrawn;
  LinkageConditions conditions;
  /// The shape from which opening begins; empty: as drawn. Pins without positions hold joints at
  /// their positions in it.
  std::optional<rods::StateNumbers> shape;
  /// The conditions for which that shape is in equilibrium; it continues from them to `conditions`.
  /// Empty: `conditions`.
  std::optional<LinkageConditions> shape_conditions = {};
};

/// Everything that is wrong with conditions for so many joints and segments; fields are relative to
/// them ("pins[2].joint").
[[nodiscard]] std::vector<Issue> validate(const LinkageConditions& conditions, int joints,
                                          int segments);

}  // namespace limber::scene
