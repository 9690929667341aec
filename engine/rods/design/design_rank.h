#pragma once

namespace limber::rods {

/// Rank that compares designs of one goal.
struct DesignRank {
  /// Violation of a constraint that counts as none: for flatness and area as a share of the allowed
  /// value, for angles in radians.
  static constexpr double kHolds = 1e-3;

  double violation = 0;  // of a constraint, the largest number, in its unit; 0 where all hold
  double objective = 0;

  /// @param least_room  the least room of a constraint until its bound: for flatness and area as a
  ///   share of the allowed value, for angles [rad]; < 0 if it is violated
  [[nodiscard]] static DesignRank of(double objective, double least_room) {
    return {-least_room > kHolds ? -least_room : 0, objective};
  }
  [[nodiscard]] bool holds() const { return violation == 0; }
  /// Designs that keep the constraints come before the others. If both keep them, the one of less
  /// objective is first; if neither does, the one that violates less.
  [[nodiscard]] bool before(const DesignRank& other) const {
    return violation < other.violation || (holds() && other.holds() && objective < other.objective);
  }
};

}  // namespace limber::rods
