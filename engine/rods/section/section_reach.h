#pragma once

#include <Eigen/Core>

#include "engine/rods/section/section.h"

namespace limber::rods {

/// section_outline about the centroid, with the principal axes on (d_1, d_2) as section_stiffness
/// has them.
[[nodiscard]] Polygon placed_outline(const Section& section, const SectionProperties& properties,
                                     StiffAxis axis = StiffAxis::kD1);

/// Size of section_outline, along x and along y.
[[nodiscard]] Eigen::Array2d outline_size(const Section& section);

/// Rods longer than so many times their least thickness open slowly, if at all: their section is
/// likely given in another unit of length.
inline constexpr double kMaxSlenderness = 2e4;

/// Largest distances of a section from its centroid, where bending strains most.
class SectionReach {
 public:
  /// @param properties  of this section
  SectionReach(const Section& section, const SectionProperties& properties,
               StiffAxis axis = StiffAxis::kD1);

  struct Span {
    double least = 0, most = 0;
  };
  /// Span of direction . p over the points p of the section, on (d_1, d_2); exact for round ones
  /// too.
  [[nodiscard]] Span along(const Eigen::Vector2d& direction) const;

 private:
  Polygon outline_;
  Eigen::Vector2d radii_ = Eigen::Vector2d::Zero();  // of ellipses; zero: the outline counts
};

}  // namespace limber::rods
