#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/beams/element/element_energy.h"
#include "engine/beams/model/beam_model.h"
#include "engine/beams/structure/beam_state.h"

namespace limber::beams {

enum class ElementEnd { kStart = 0, kFinish = 1 };

/// An end that turns against its node, with one unknown per released rotation. Two axes are a
/// universal joint: the first stays with the node, the second with the beam. Three are a ball.
struct ReleasedEnd {
  int element = 0;
  ElementEnd end = ElementEnd::kStart;
  int node = 0;
  int axes = 0;          // 1 to 3
  Eigen::Matrix3d rest;  // columns: the released axes at rest, in space; the first `axes` count
  int unknown = 0;       // first of its unknowns
};

/// A model prepared for computing: constants of elements, and the unknowns of each node.
///
/// Unknowns are increments from a state, 6 * node + axis: translation along, then spin about the
/// axes of the node's support. Without a support these are its motion's axes; with neither, global
/// ones. One angle per released rotation follows. If a node is held about one axis alone, spins are
/// about axes that go along with half of its swing (spin_axes). Immutable; may be read from several
/// threads.
class BeamStructure {
 public:
  /// @throws Error as validate(model)
  explicit BeamStructure(BeamModel model);

  [[nodiscard]] const BeamModel& model() const { return model_; }
  [[nodiscard]] int nodes() const { return static_cast<int>(model_.nodes.size()); }
  [[nodiscard]] int elements() const { return static_cast<int>(model_.elements.size()); }
  [[nodiscard]] int unknowns() const { return unknowns_; }

  [[nodiscard]] const ElementConstants<double>& constants(int element) const {
    return constants_[static_cast<std::size_t>(element)];
  }
  /// Columns are the element's axes as drawn.
  [[nodiscard]] const Eigen::Matrix3d& rest_axes(int element) const {
    return rest_axes_[static_cast<std::size_t>(element)];
  }
  [[nodiscard]] const std::vector<ReleasedEnd>& released_ends() const { return released_; }
  /// Index into released_ends(), -1: the end is fixed to its node.
  [[nodiscard]] int released(int element, ElementEnd end) const {
    return released_of_[static_cast<std::size_t>(element)][static_cast<std::size_t>(end)];
  }
  /// Columns: the axes of a node's translations, and of its supports and motions.
  [[nodiscard]] const Eigen::Matrix3d& node_axes(int node) const {
    return node_axes_[static_cast<std::size_t>(node)];
  }
  /// For a node that is held about one axis alone.
  struct Swing {
    int axis = -1;     // which one; -1: the node is held about none, or about several
    double twist = 0;  // that it is brought to [rad]
  };
  [[nodiscard]] const Swing& swing(int node) const {
    return swings_[static_cast<std::size_t>(node)];
  }
  /// Is a node held about one axis alone, and has it swung by half a turn across it? There any roll
  /// about that axis is free.
  [[nodiscard]] bool has_swung_by_half_a_turn(const BeamState& state, int node) const;
  /// Columns: the axes of a node's spins, with its rotation from rest. They are those of its
  /// translations. At a node held about one axis alone they are turned by half of its swing: a spin
  /// about the two free axes then keeps its twist about the held one.
  [[nodiscard]] Eigen::Matrix3d spin_axes(int node, const Eigen::Quaterniond& rotation) const;
  /// A motion of the model.
  [[nodiscard]] PrescribedMotion motion_by_node_axes(const PrescribedMotion& motion) const;
  /// Per unknown: 1 where it does not follow from forces: supports, motions, and rotations that no
  /// beam feels.
  [[nodiscard]] const std::vector<char>& held() const { return held_; }
  /// Length of beams that a node stands for [length].
  [[nodiscard]] double tributary_length(int node) const {
    return tributary_[static_cast<std::size_t>(node)];
  }

  /// As drawn.
  [[nodiscard]] BeamState rest_state() const;

  /// The state after increments: exp(spin) from the left on rotations.
  [[nodiscard]] BeamState moved(const BeamState& state,
                                const Eigen::Ref<const Eigen::VectorXd>& increments) const;

  [[nodiscard]] ElementEnds ends(const BeamState& state, int element) const;
  /// Rotation from rest of an end's section.
  [[nodiscard]] Eigen::Quaterniond end_rotation(const BeamState& state, int element,
                                                ElementEnd end) const;
  /// Columns: where the released axes of an end are in a state.
  [[nodiscard]] Eigen::Matrix3d turned_axes(const BeamState& state,
                                            const ReleasedEnd& released) const;

 private:
  void add_element(int element);
  void add_release(int element, ElementEnd end, const EndRelease& release);
  void hold();

  BeamModel model_;
  std::vector<ElementConstants<double>> constants_;
  std::vector<Eigen::Matrix3d> rest_axes_;
  std::vector<ReleasedEnd> released_;
  std::vector<std::array<int, 2>> released_of_;
  std::vector<Eigen::Matrix3d> node_axes_;
  std::vector<Swing> swings_;
  std::vector<char> held_;
  std::vector<double> tributary_;
  int unknowns_ = 0;
};

/// exp(spin^x) as a quaternion.
[[nodiscard]] Eigen::Quaterniond rotation_by(const Eigen::Vector3d& spin);

}  // namespace limber::beams
