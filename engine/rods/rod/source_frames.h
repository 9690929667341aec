#pragma once

#include <Eigen/Core>

#include "engine/rods/rod/rod_layout.h"

namespace limber::rods {

/// Start of the transport of the reference frames. Every edge has a unit tangent and a unit
/// director orthogonal to it, every interior vertex the twist from one reference frame to the next
/// [rad], any number of turns. Energies and gradients are functions of the unknowns and of this,
/// which therefore never changes; a RodAtSource has its own.
class SourceFrames {
 public:
  /// Columns: tangent (3), director (3), twist (1). Rows as the layout's slots.
  enum Field { kTangent = 0, kDirector = 3, kTwist = 6, kFields = 7 };

  /// Directors without twist along each rod.
  /// @param unknowns  as RodLayout; angles are not read
  /// @param first_directors  3 x rods: of the first edge of every rod, made orthogonal to it and
  /// unit; a zero column leaves the choice here
  /// @throws Error{kInvalidArgument} naming rod and edge or vertex: edges of no length, edges that
  /// fold back onto the one before, a director along its edge
  [[nodiscard]] static SourceFrames without_twist(
      const RodLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& unknowns,
      const Eigen::Ref<const Eigen::Matrix3Xd>& first_directors);

  /// Given directors: twists are those from each to the next, in (-pi, pi].
  /// @param directors  3 x nodes, of the edge of every slot, made orthogonal to it and unit
  /// @throws Error as above
  [[nodiscard]] static SourceFrames from_directors(
      const RodLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& unknowns,
      const Eigen::Ref<const Eigen::Matrix3Xd>& directors);

  [[nodiscard]] const SlotArray& values() const { return values_; }

 private:
  friend class RodAtSource;
  explicit SourceFrames(SlotArray values) : values_(std::move(values)) {}
  SlotArray values_;
};

}  // namespace limber::rods
