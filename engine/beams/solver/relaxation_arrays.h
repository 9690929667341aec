#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/rotations/exponential_coefficients.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

using Lanes = rotations::Pack<double>;
inline constexpr int kLanes = static_cast<int>(Lanes::size());  // elements of a batch

/// Numbers of elements side by side: row c of batch b at data[(b * rows + c) * kLanes].
class LaneRows {
 public:
  LaneRows(int rows, int batches)
      : rows_(rows), values_(static_cast<std::size_t>(rows) * batches * kLanes, 0.0) {}
  [[nodiscard]] double* row(int batch, int c) { return values_.data() + place(batch, c); }
  [[nodiscard]] const double* row(int batch, int c) const {
    return values_.data() + place(batch, c);
  }
  [[nodiscard]] double& at(int element, int c) {
    return row(element / kLanes, c)[element % kLanes];
  }
  [[nodiscard]] int index(int element, int c) const {
    return static_cast<int>(place(element / kLanes, c)) + element % kLanes;
  }
  [[nodiscard]] const double* data() const { return values_.data(); }

 private:
  [[nodiscard]] std::size_t place(int batch, int c) const {
    return (static_cast<std::size_t>(batch) * rows_ + c) * kLanes;
  }
  int rows_;
  std::vector<double> values_;
};

/// Frame at an end of an element: a position and a rotation. Nodes come first, then released ends.
struct FrameSlot {
  double position[3];
  double rotation[4];  // quaternion w, x, y, z
  double unused = 0;
};

/// Outputs of the kernel for each element.
enum ResponseRow {
  kForce = 0,         // on the finish, 3
  kStartMoment = 3,   // 3
  kFinishMoment = 6,  // 3
  kAxial = 9,         // tension, 1
  kResponseRows = 10
};

/// Data of fictitious masses: upper bounds of an element's stiffness at each of its ends, as
/// symmetric matrices (xx, yx, yy, zx, zy, zz). Behind them the chord that they were computed at.
enum BoundRow { kTranslation = 0, kRotation = 6, kBoundRows = 12, kChord = 12, kAllBoundRows = 15 };

/// All elements of a structure, for kernels.
class RelaxationElements {
 public:
  explicit RelaxationElements(const BeamStructure& structure);

  [[nodiscard]] int batches() const { return batches_; }
  [[nodiscard]] int slots() const { return slots_; }
  [[nodiscard]] int start_slot(int element) const { return slot_[place(element, 0)]; }
  [[nodiscard]] int finish_slot(int element) const { return slot_[place(element, 1)]; }

  /// Forces and moments of all elements; V is Lanes, or double for a plain loop that gives the same
  /// up to rounding.
  template <class V>
  void respond(const FrameSlot* slots, LaneRows& responses) const;

  /// Bounds at the present state, valid while chords turn no more than since the last call; see
  /// NOTATION.md.
  void bound(const FrameSlot* slots, LaneRows& bounds) const;

 private:
  enum ConstantRow {
    kLength,
    kStretching,
    kTorsion,
    kNear2,
    kFar2,
    kNear3,
    kFar3,
    kBow,
    kRestTwist,
    kRestAngle2,
    kRestAngle3,
    kLeastStretch,
    kSlack,         // stiffness across that a cable counts with where nothing pulls it; 0 of beams
    kRestRotation,  // of the axes as drawn, 4
    kConstantRows = kRestRotation + 4
  };
  [[nodiscard]] static std::size_t place(int element, int end) {
    return static_cast<std::size_t>((element / kLanes * 2 + end) * kLanes + element % kLanes);
  }

  int batches_ = 0;
  int slots_ = 0;
  LaneRows constants_;
  std::vector<std::int32_t> slot_;

  template <class V>
  friend struct ElementLoader;
};

extern template void RelaxationElements::respond<Lanes>(const FrameSlot*, LaneRows&) const;
extern template void RelaxationElements::respond<double>(const FrameSlot*, LaneRows&) const;

}  // namespace limber::beams::detail
