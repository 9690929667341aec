#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/beams/results/section_forces.h"
#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams {

/// Forces and moments along one element of a structure, from the loads on its start and over its
/// length: they balance at every place of it. See NOTATION.md, "Forces that results give".
class ElementForceDistribution {
 public:
  ElementForceDistribution(const BeamStructure& structure, const NodeLoads& loads,
                           const BeamState& state, int element);

  /// @param share  of the length at rest, from the start; in [0, 1]
  [[nodiscard]] SectionForces at(double share) const;

 private:
  void set_shape(const ElementEnds& ends, double length);
  void add_particular_deflection(const BeamSection& section, double length, double axial);

  bool is_cable_ = false;
  Eigen::Vector3d force_, moment_;           // on the start, from outside the element
  Eigen::Vector3d load_, load_change_;       // resultant of the load as at the start; to the finish
  Eigen::Vector3d linear_, square_, cubic_;  // of the cubic, less its start
  Eigen::Vector3d particular_ = Eigen::Vector3d::Zero();  // deflection, of s^2 (1 - s)^2
  Eigen::Matrix3d start_axes_, finish_axes_;
};

/// Forces and moments along the elements of a structure, each of which may have been cut.
class ForceDistributions {
 public:
  ForceDistributions() = default;
  /// @param first_part  per element, and the end: see Subdivision
  ForceDistributions(std::vector<ElementForceDistribution> parts, std::vector<int> first_part)
      : parts_(std::move(parts)), first_part_(std::move(first_part)) {}

  /// @param share  of the element's length at rest, from its start; in [0, 1]
  [[nodiscard]] SectionForces at(int element, double share) const;
  [[nodiscard]] const std::vector<ElementForceDistribution>& parts() const { return parts_; }

 private:
  std::vector<ElementForceDistribution> parts_;
  std::vector<int> first_part_;
};

/// The largest and the smallest value of a force or moment along an element, and their places:
/// shares of the length at rest.
struct Extremes {
  double least = 0, least_place = 0;
  double largest = 0, largest_place = 0;

  /// That of the larger size, with its sign.
  [[nodiscard]] double peak() const { return -least > largest ? least : largest; }
};
using ElementExtremes = std::array<Extremes, SectionForces::kComponents>;

/// The largest equivalent stress along an element, and its place.
struct GoverningStresses {
  ElementStresses stresses;
  double place = 0;
};

/// Extremes within the element are found, not only those of its ends: by parabolas from nine places
/// on.
[[nodiscard]] ElementExtremes extremes_of(const ElementForceDistribution& distribution);
[[nodiscard]] GoverningStresses governing_stresses(const ElementForceDistribution& distribution,
                                                   const BeamSection& section,
                                                   const ElementExtremes& extremes);

}  // namespace limber::beams
