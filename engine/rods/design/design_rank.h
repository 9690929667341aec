#pragma once

namespace limber::rods {

/// What designs of one goal are compared by.
struct DesignRank {
  /// Violation of a constraint that counts as none: of flatness and of area as a share of what is
  /// allowed, of angles in radians.
  static constexpr double kHolds = 1e-3;

  double violation = 0;  // of a constraint, the largest number, in its unit; 0 where all hold
  double objective = 0;

  /// @param least_room  what the constraint with the least of it has left until its bound, of
  ///   flatness and of area as a share of what is allowed, of angles [rad]; < 0 where it is
  ///   violated
  [[nodiscard]] static DesignRank of(double objective, double least_room) {
    return {-least_room > kHolds ? -least_room : 0, objective};
  }
  [[nodiscard]] bool holds() const { return violation == 0; }
  /// What keeps the constraints before what does not, of that the one of less objective, of what
  /// does not the one that violates less.
  [[nodiscard]] bool before(const DesignRank& other) const {
    return violation < other.violation || (holds() && other.holds() && objective < other.objective);
  }
};

}  // namespace limber::rods
