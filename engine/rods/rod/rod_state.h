#pragma once

#include <memory>

#include "engine/rods/rod/rod_hessian.h"
#include "engine/rods/rod/rod_parameters.h"
#include "engine/rods/rod/source_frames.h"

namespace limber::rods {

struct RodEnergies {
  double stretching = 0;
  double bending = 0;
  double twisting = 0;
  [[nodiscard]] double total() const { return stretching + bending + twisting; }
};

/// Rods at given unknowns: present tangents, material frames (transported from the source frames by
/// the smallest rotation, then turned by theta) and twists. Values of this type cannot be stale:
/// unknowns do not change without everything else. Energy and gradient are functions of the
/// unknowns with the source held fixed. They are exact at any distance from the source. If an edge
/// points opposite to its source tangent, has no length, or folds back onto its neighbour,
/// `is_finite` is false.
///
/// Theory: (rod linkages, sec. 4.1 and 5, "finite transport").
class RodState {
 public:
  /// @param unknowns  layout->unknowns() numbers, ordered as RodLayout says
  RodState(std::shared_ptr<const RodLayout> layout, std::shared_ptr<const SourceFrames> source,
           const Eigen::Ref<const Eigen::VectorXd>& unknowns);

  [[nodiscard]] const RodLayout& layout() const { return *layout_; }
  [[nodiscard]] const SourceFrames& source() const { return *source_; }
  [[nodiscard]] const Eigen::VectorXd& unknowns() const { return unknowns_; }
  [[nodiscard]] const std::shared_ptr<const RodLayout>& shared_layout() const { return layout_; }
  [[nodiscard]] const std::shared_ptr<const SourceFrames>& shared_source() const { return source_; }

  /// Frame of the edge of a slot; strains of the vertex of a slot, as a form measures them.
  /// @pre the slot has one
  [[nodiscard]] MaterialFrame<double> frame(int slot) const;
  [[nodiscard]] VertexStrains<double> strains(
      int slot, BendingForm form = BendingForm::kMaterialFrames) const;
  /// Whether every frame and strain is finite.
  [[nodiscard]] bool is_finite() const;

  [[nodiscard]] RodEnergies energies(const RodParameters& parameters) const;
  [[nodiscard]] double energy(const RodParameters& parameters) const {
    return energies(parameters).total();
  }
  /// By the unknowns; zero for the angle of a slot without edge.
  [[nodiscard]] Eigen::VectorXd gradient(const RodParameters& parameters) const;
  /// Both in one sweep, and the energies of every slot: stretching of its edge, bending and
  /// twisting of its vertex (a column each).
  struct Forces {
    RodEnergies energies;
    Eigen::VectorXd gradient;
    SlotArray energies_by_slot;
  };
  [[nodiscard]] Forces forces(const RodParameters& parameters) const;

  /// The present strains as those at rest: this shape then has neither bending nor twisting energy.
  /// Rest lengths become the present ones.
  void set_as_rest(RodParameters& parameters) const;

  /// Internal columns of frames and twists, for kernels (`rod_passes.h`).
  [[nodiscard]] const SlotArray& frame_slots() const { return frames_; }
  [[nodiscard]] const SlotArray& twist_slots() const { return twists_; }
  [[nodiscard]] const SlotArray& unknown_slots() const { return unknown_slots_; }

 private:
  friend class RodAtSource;
  std::shared_ptr<const RodLayout> layout_;
  std::shared_ptr<const SourceFrames> source_;
  Eigen::VectorXd unknowns_;
  SlotArray unknown_slots_;
  SlotArray frames_;
  SlotArray twists_;
};

/// A state whose source frames are its present frames: the one place where the Hessian has its
/// simple form. It is made from a state by moving the source there. This keeps unknowns, material
/// frames, strains and energies to the last bit; the twist continues past any number of turns. The
/// gradient changes only by the holonomy term. Newton's method makes one at every iterate and then
/// moves within its source frames.
class RodAtSource {
 public:
  /// @throws Error{kFailedPrecondition} if the state is not finite
  explicit RodAtSource(RodState state);

  [[nodiscard]] const RodState& state() const { return state_; }
  /// Other unknowns, seen from these source frames.
  [[nodiscard]] RodState moved(const Eigen::Ref<const Eigen::VectorXd>& unknowns) const {
    return {state_.layout_, state_.source_, unknowns};
  }
  /// Exact second derivatives, symmetric.
  [[nodiscard]] HessianBlocks hessian(const RodParameters& parameters) const;

 private:
  RodState state_;
};

}  // namespace limber::rods
