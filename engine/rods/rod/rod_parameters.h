#pragma once

#include "engine/rods/rod/length_weights.h"
#include "engine/rods/rod/rod_layout.h"

namespace limber::rods {

/// Material and rest shape of a rod, a row per slot. Also the shape of a direction of change of all
/// these numbers (for derivatives by rest lengths, section scales, ...).
///
/// Columns: `Parameter`. Curvatures and twist at rest are integrated, as the strains are. The
/// curvature of an arc of radius R is 2 tan(l / 2R) per vertex, not 1 / R (kTurningAngle: l / R).
class RodParameters {
 public:
  enum Parameter {
    kRestLength,   // of the edge [length], positive
    kStretching,   // of the edge: E A [force] times its density (see stretch_element.h)
    kBending1,     // of the vertex: B_1 against kappa_1, about d2 [force length^2]
    kBending2,     // of the vertex: B_2 against kappa_2, about d1
    kTorsion,      // of the vertex: G J [force length^2]
    kRestBefore1,  // of the vertex: kappa_1 at rest in the frame of the edge before it
    kRestBefore2,  // kappa_2
    kRestAfter1,   // the same in the frame of the edge after it
    kRestAfter2,
    kRestTwist,  // of the vertex [rad]
    kParameters
  };

  /// Everything zero, and rest length 1 where there is no edge (a value that no result depends on).
  explicit RodParameters(const RodLayout& layout);
  /// A direction of change: everything zero.
  [[nodiscard]] static RodParameters direction(const RodLayout& layout);

  [[nodiscard]] double operator()(int slot, Parameter p) const { return values_(slot, p); }
  [[nodiscard]] double& operator()(int slot, Parameter p) { return values_(slot, p); }
  [[nodiscard]] const SlotArray& values() const { return values_; }

  /// @throws Error{kInvalidArgument} naming rod, edge or vertex, and the value: lengths and
  /// stiffnesses must be positive and finite, rest strains finite
  void validate(const RodLayout& layout) const;

  BendingForm form = kDefaultBending;

 private:
  SlotArray values_;
};

}  // namespace limber::rods
