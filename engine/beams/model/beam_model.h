#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/beams/model/section.h"

// Plain values that define a structure of beams. Any consistent units of length, force and mass.

namespace limber::beams {

struct BeamNode {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();       // at rest [length]
  Eigen::Vector3d normal = Eigen::Vector3d(0.0, 0.0, 1.0);  // need not have unit length
};

enum class BeamKind {
  kBeam,   // stretches, twists and bends in two planes
  kCable,  // pulls only: no force where it is shorter than at rest, no moments ever
};

/// Releases: components that an end of a beam does not pass on to its node, by axis of the element
/// at rest (1: along the beam, 3: towards the normal). Released rotations are hinges that turn with
/// the node and may turn by any angle; all three are a ball joint. Released forces are slides, and
/// meant to be short beside the element.
struct EndRelease {
  std::array<bool, 3> forces{};     // axial, shear along axis 2, shear along axis 3
  std::array<bool, 3> rotations{};  // about axis 1 (twist), 2, 3

  friend bool operator==(const EndRelease&, const EndRelease&) = default;
};

struct BeamElement {
  int start = 0;  // nodes
  int finish = 0;
  int section = 0;  // of the model's
  BeamKind kind = BeamKind::kBeam;
  /// Third axis of the section before it is made perpendicular to the beam; zero: see drawn_normal.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double rest_length = 0;  // [length]; 0: as drawn
  /// Curvature at rest of the element beyond the drawn one: rotation of the section per length,
  /// about axes 1 (twist), 2 and 3 of the element [1/length].
  Eigen::Vector3d rest_curvature = Eigen::Vector3d::Zero();
  EndRelease start_release;
  EndRelease finish_release;
};

/// Directions of a node that do not move: translations along and rotations about the columns of
/// `axes`, which stay where they are.
struct BeamSupport {
  int node = 0;
  std::array<bool, 6> fixed{};                         // three translations, three rotations
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // orthonormal, right-handed columns
  bool operator==(const BeamSupport&) const = default;
};

/// Prescribed place of a node, ramped with the load steps. A support of the same node may fix other
/// directions by the same axes, or by others as far as these span the same (see by_axes).
///
/// Rotations that a support and a motion hold together, about all three axes: exp of a rotation
/// vector. About two axes: exp of one that has no component along the third, and then any rotation
/// about the third. About one alone: the twist about it, and then any rotation about some axis
/// across it (a joint of constant velocity). Rotations depend on the state alone: no path matters.
struct PrescribedMotion {
  int node = 0;
  std::array<bool, 3> translates{};  // which components of `translation` are prescribed
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // from rest, along axes [length]
  std::array<bool, 3> rotates{};                          // which components of `rotation`
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();     // about axes, from rest [rad], any size
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();     // orthonormal, right-handed columns

  [[nodiscard]] bool translates_any() const {
    return translates[0] || translates[1] || translates[2];
  }
  [[nodiscard]] bool rotates_any() const { return rotates[0] || rotates[1] || rotates[2]; }
  [[nodiscard]] bool translates_all() const {
    return translates[0] && translates[1] && translates[2];
  }
  [[nodiscard]] bool rotates_all() const { return rotates[0] && rotates[1] && rotates[2]; }
  bool operator==(const PrescribedMotion&) const = default;
};

/// The same motion by other axes, with zeros in directions that it does not give. The result is
/// empty if one of these lies neither in the span of the given directions nor across it: three go
/// with any axes.
[[nodiscard]] std::optional<PrescribedMotion> by_axes(const PrescribedMotion& motion,
                                                      const Eigen::Matrix3d& axes);

enum class LoadDirection {
  kFixed,      // keeps its direction in space
  kFollowing,  // turns with the node or the element that it acts on; given as it is at rest
};

struct NodalLoad {
  int node = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // [force length]
  LoadDirection direction = LoadDirection::kFixed;
  bool operator==(const NodalLoad&) const = default;
};

struct DistributedLoad {
  int element = 0;
  /// Per length at rest, in global axes at rest [force/length]; acts all along the element.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  LoadDirection direction = LoadDirection::kFixed;
  bool operator==(const DistributedLoad&) const = default;
};

/// Does an element that bends get shorter between its ends? With it an element buckles by itself
/// and answers converge with the fourth power of its length. Without it, elements are those of the
/// paper, stiff under pressure and of second order.
enum class Bowing { kCounts, kLeftOut };

/// For a model whose elements were cut: the element of which an element is a part.
struct ElementPart {
  int element = 0;
  int part = 0;   // from 0, from the element's start
  int parts = 1;  // that the element has
};

struct BeamModel {
  std::vector<BeamNode> nodes;
  std::vector<BeamSection> sections;
  std::vector<BeamElement> elements;
  std::vector<BeamSupport> supports;
  std::vector<PrescribedMotion> motions;
  std::vector<NodalLoad> loads;
  std::vector<DistributedLoad> distributed_loads;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // acceleration of masses [length/time^2]
  /// Act while loads and motions are brought on, and are gone at the end: they choose the side to
  /// which a plane structure buckles.
  std::vector<NodalLoad> temporary_loads;
  Bowing bowing = Bowing::kCounts;
  /// Per element, or empty if nothing was cut. Messages use names of elements and nodes that users
  /// know: see element_name.
  std::vector<ElementPart> element_parts;
};

/// @throws Error naming the member, e.g. "elements[3].finish":
///   {kOutOfRange} a node, section or element that does not exist;
///   {kInvalidArgument} values that are not finite; an element of zero length or along a normal of
///     its own;
///     two elements between the same nodes; sections that are not positive; axes that are not
///     orthonormal and right-handed; a node with two motions, one that moves what a support fixes,
///     or one by axes that mix with its support's; a moment on a node about an axis about which
///     nothing holds it (a ball joint, or hinges of all its beams);
///   {kFailedPrecondition} nothing holds a structure that hangs together (no support, no motion)
void validate(const BeamModel& model);
/// The same of a model whose nodes, sections and elements are known to be valid: looks at supports,
/// motions and loads alone.
void validate_conditions(const BeamModel& model);

/// If a node is both fixed and moved along the same axis, the motion holds: clears the fixed
/// directions of supports that a motion gives. Motions by axes that mix with those of the support
/// are left to validate().
void give_motions_precedence(BeamModel& model);

/// For each node 1 if an element uses it, else 0; a model without elements uses all of them.
/// @pre nodes of elements exist
[[nodiscard]] std::vector<char> used_nodes(const BeamModel& model);

/// "element 7", or "element 7, part 2 of 4" of a model that was cut.
[[nodiscard]] std::string element_name(const BeamModel& model, int element);
/// "node 7", or "a point inside of element 7" between its parts.
[[nodiscard]] std::string node_name(const BeamModel& model, int node);

/// Length between the nodes as drawn.
[[nodiscard]] double drawn_length(const BeamModel& model, int element);

/// Direction towards which the third axis of an element points, not yet perpendicular to it. It is
/// the element's own normal, or without one the mean of its nodes' normals. If this is within 0.1
/// degrees of the element's direction (a vertical member with the default normal), it is global z;
/// if that is, too, global x.
[[nodiscard]] Eigen::Vector3d drawn_normal(const BeamModel& model, int element);

/// Columns are axes 1, 2, 3 of an element as drawn. Axis 1 goes from start to finish, axis 3
/// towards the normal, axis 2 = axis 3 x axis 1 (bending-active, eq. 4 to 6).
[[nodiscard]] Eigen::Matrix3d drawn_frame(const BeamModel& model, int element);

}  // namespace limber::beams
