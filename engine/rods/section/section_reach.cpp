#include "engine/rods/section/section_reach.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace limber::rods {
namespace {

/// Radii along the first and the second principal axis; zero if the section is not round.
Eigen::Vector2d principal_radii(const Section& section) {
  if (const auto* ellipse = std::get_if<Ellipse>(&section)) {
    return 0.5 * Eigen::Vector2d(std::max(ellipse->width, ellipse->height),
                                 std::min(ellipse->width, ellipse->height));
  }
  if (const auto* tube = std::get_if<Tube>(&section))
    return Eigen::Vector2d::Constant(0.5 * tube->diameter);
  return Eigen::Vector2d::Zero();
}

}  // namespace

Polygon placed_outline(const Section& section, const SectionProperties& properties,
                       StiffAxis axis) {
  const Eigen::Vector2d first = properties.axis_1, second(-first.y(), first.x());
  const StiffAxis stiff = stiff_axis_of(properties, axis);
  Polygon result;
  for (const Eigen::Vector2d& corner : section_outline(section)) {
    const Eigen::Vector2d p = corner - properties.centroid;
    const Eigen::Vector2d principal(first.dot(p), second.dot(p));
    // A quarter turn: d_2 takes the first axis and -d_1 the second, so that the sense stays.
    result.push_back(stiff == StiffAxis::kD1 ? principal
                                             : Eigen::Vector2d(-principal.y(), principal.x()));
  }
  return result;
}

Eigen::Array2d outline_size(const Section& section) {
  const Polygon outline = section_outline(section);
  Eigen::Array2d low = outline.front().array(), high = low;
  for (const Eigen::Vector2d& corner : outline) {
    low = low.min(corner.array());
    high = high.max(corner.array());
  }
  return high - low;
}

SectionReach::SectionReach(const Section& section, const SectionProperties& properties,
                           StiffAxis axis)
    : outline_(placed_outline(section, properties, axis)), radii_(principal_radii(section)) {
  if (stiff_axis_of(properties, axis) == StiffAxis::kD2) std::swap(radii_[0], radii_[1]);
}

SectionReach::Span SectionReach::along(const Eigen::Vector2d& direction) const {
  if (radii_[0] > 0) {
    const double reach = radii_.cwiseProduct(direction).norm();
    return {-reach, reach};
  }
  Span span{direction.dot(outline_[0]), direction.dot(outline_[0])};
  for (const Eigen::Vector2d& corner : outline_) {
    span.least = std::min(span.least, direction.dot(corner));
    span.most = std::max(span.most, direction.dot(corner));
  }
  return span;
}

}  // namespace limber::rods
