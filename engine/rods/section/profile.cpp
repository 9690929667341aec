#include "engine/rods/section/profile.h"

#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "engine/base/error.h"

namespace limber::rods {

namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

const Eigen::Vector2d& next(const Polygon& polygon, std::size_t i) {
  return polygon[(i + 1) % polygon.size()];
}

/// Distance of a point to a segment.
double distance(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d e = b - a;
  const double s = std::clamp((p - a).dot(e) / e.squaredNorm(), 0.0, 1.0);
  return (p - a - s * e).norm();
}

/// Whether segments cross, or come closer than `tolerance`.
bool touch(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
           const Eigen::Vector2d& d, double tolerance) {
  const Eigen::Vector2d e = b - a, f = d - c;
  const bool apart = (cross(e, c - a) > 0) == (cross(e, d - a) > 0) ||
                     (cross(f, a - c) > 0) == (cross(f, b - c) > 0);
  return !apart || std::min({distance(a, c, d), distance(b, c, d), distance(c, a, b),
                             distance(d, a, b)}) <= tolerance;
}

bool contains(const Polygon& polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = next(polygon, i);
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

[[noreturn]] void refuse_profile(const std::string& field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

void validate_alone(const Polygon& polygon, const std::string& name, double tolerance) {
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (!((next(polygon, i) - polygon[i]).norm() > tolerance))
      refuse_profile(fmt::format("{}[{}]", name, i), "this vertex and the next are the same point");
    const Eigen::Vector2d before = polygon[i] - polygon[(i + n - 1) % n],
                          after = next(polygon, i) - polygon[i];
    if (std::abs(cross(before, after)) <= 1e-12 * before.norm() * after.norm() &&
        before.dot(after) < 0)
      refuse_profile(fmt::format("{}[{}]", name, i),
                     "the outline turns back onto itself at this vertex");
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j == n - 1) continue;
      if (touch(polygon[i], next(polygon, i), polygon[j], next(polygon, j), tolerance))
        refuse_profile(name,
                       fmt::format("the edges after vertices {} and {} cross or touch", i, j));
    }
  }
}

void validate_apart(const Polygon& a, const Polygon& b, const std::string& name,
                    const std::string& other, double tolerance) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      if (touch(a[i], next(a, i), b[j], next(b, j), tolerance))
        refuse_profile(name, fmt::format("edge {} crosses or touches edge {} of {}", i, j, other));
}

std::string hole_name(std::size_t h) { return fmt::format("section.holes[{}]", h); }

}  // namespace

double signed_area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += cross(polygon[i] - polygon[0], next(polygon, i) - polygon[0]);
  return 0.5 * twice;
}

void Profile::validate() const {
  const std::string outer = "section.outer";
  double size = 0;
  const auto count_and_numbers = [&](const Polygon& polygon, const std::string& name) {
    if (polygon.size() < 3)
      refuse_profile(name, fmt::format("a polygon needs three vertices, got {}", polygon.size()));
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      if (!polygon[i].allFinite())
        refuse_profile(fmt::format("{}[{}]", name, i), "coordinates must be finite");
      size = std::max(size, (polygon[i] - polygon[0]).norm());
    }
  };
  count_and_numbers(outline, outer);
  for (std::size_t h = 0; h < holes.size(); ++h) count_and_numbers(holes[h], hole_name(h));
  const double tolerance = 1e-9 * size;
  validate_alone(outline, outer, tolerance);
  for (std::size_t h = 0; h < holes.size(); ++h) {
    validate_alone(holes[h], hole_name(h), tolerance);
    validate_apart(holes[h], outline, hole_name(h), outer, tolerance);
    if (!contains(outline, holes[h][0]))
      refuse_profile(hole_name(h), "a hole must lie inside the outline");
    for (std::size_t g = 0; g < h; ++g) {
      validate_apart(holes[h], holes[g], hole_name(h), hole_name(g), tolerance);
      if (contains(holes[g], holes[h][0]) || contains(holes[h], holes[g][0]))
        refuse_profile(hole_name(h), "a hole must not lie inside " + hole_name(g));
    }
  }
}

Profile Profile::oriented() const {
  Profile result = *this;
  if (signed_area(result.outline) < 0) std::reverse(result.outline.begin(), result.outline.end());
  for (Polygon& hole : result.holes)
    if (signed_area(hole) > 0) std::reverse(hole.begin(), hole.end());
  return result;
}

AreaMoments area_moments(const Profile& profile) {
  const Profile oriented = profile.oriented();
  std::vector<const Polygon*> polygons{&oriented.outline};
  for (const Polygon& hole : oriented.holes) polygons.push_back(&hole);
  const Eigen::Vector2d origin = oriented.outline[0];
  // Signed triangles from the origin, first for the centroid, then about it.
  AreaMoments result;
  const auto triangles = [&](const Eigen::Vector2d& from, auto&& add) {
    for (const Polygon* polygon : polygons)
      for (std::size_t i = 0; i < polygon->size(); ++i) {
        const Eigen::Vector2d a = (*polygon)[i] - from, b = next(*polygon, i) - from;
        add(0.5 * cross(a, b), a, b);
      }
  };
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  triangles(origin, [&](double area, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    result.area += area;
    first += area / 3 * (a + b);
  });
  result.centroid = origin + first / result.area;
  triangles(result.centroid, [&](double area, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d sum = a + b;
    result.second += area / 12 * (a * a.transpose() + b * b.transpose() + sum * sum.transpose());
  });
  return result;
}

}  // namespace limber::rods
