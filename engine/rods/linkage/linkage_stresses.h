#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_strains.h"
#include "engine/rods/section/section_reach.h"

namespace limber::rods {

/// Quantities that a rod carries at a station, in units of the model: a row each.
enum RodField : int {
  kAxialStrain,
  kAxialForce,      // N = EA strain [force]
  kCurvature1,      // [1/length]: the rod curves towards d_1
  kCurvature2,      // towards d_2
  kTwistRate,       // [rad/length]
  kBendingMoment1,  // lambda_1 kappa_1 [force length]
  kBendingMoment2,
  kTorque,          // [force length]
  kLargestNormal,   // stress along the rod, largest over the section [force/length^2]
  kSmallestNormal,  // and smallest: compression is negative
  kTorsionShear,    // largest shear stress by torsion over the section; NaN: it has no bound
  kVonMises,        // bound on the equivalent stress; NaN where the shear has none
  kRodFields
};

/// Stations of a segment of n edges, n + 1: its first end, its vertices x_1 .. x_(n-1), its last
/// end. An end is the middle of the joint's edge, where the rods cross, or the free end.
struct LinkageStresses {
  Eigen::Matrix<double, kRodFields, Eigen::Dynamic> stations;
  std::vector<int> first;  // station of each segment, and the number of all
};

/// The largest von Mises stress of each segment over its stations; if that has no bound, the
/// largest normal stress by magnitude.
[[nodiscard]] Eigen::VectorXd largest_stresses(const LinkageStresses& stresses);

/// Forces and stresses for given strains; if sections are scaled, those of the scaled ones.
///
/// The force of a terminal edge is that of the whole rod, although its two segments carry half of
/// its energy each. Between two edges stands their mean force. The two nearest edges and vertices
/// of a segment give the values at its end by a straight line, which is of second order. Its own
/// segment alone counts, since forces and moments may jump at joints: a terminal edge stretches by
/// the mean of both sides. Free ends carry neither moment nor torque. Normal stresses are N/A - E
/// (kappa_1 y + kappa_2 z) over the section's points (y, z) on (d_1, d_2). Shear is that of
/// Saint-Venant torsion; rods without shear strain have no other, and the share of transverse
/// forces is left out. Extremes of normal stress and of shear may be at different points: kVonMises
/// takes both at once.
class LinkageStressModel {
 public:
  /// @param section, properties, axis  source of the model's stiffnesses, with `material`
  LinkageStressModel(const Section& section, const SectionProperties& properties,
                     const RodMaterial& material, StiffAxis axis);

  [[nodiscard]] LinkageStresses evaluate(const LinkageModel& model,
                                         const LinkageStrains& strains) const;
  [[nodiscard]] double youngs_modulus() const { return young_modulus_; }

 private:
  using Station = Eigen::Matrix<double, kRodFields, 1>;
  /// @param scale  of the section
  [[nodiscard]] Station station(double axial, const Eigen::Vector3d& turning, double scale) const;

  SectionReach reach_;
  SectionStiffness stiffness_;
  double young_modulus_, shear_factor_;  // G times the section's torsion_shear, or NaN
};

}  // namespace limber::rods
