#include "engine/rods/section/torsion.h"

#include <fmt/core.h>

#include <cmath>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/rods/section/gauss_legendre.h"
#include "engine/rods/section/gmres.h"

namespace limber::rods {

namespace {

/// A straight edge of the boundary, the section to its left.
struct Side {
  Eigen::Vector2d start;
  Eigen::Vector2d along;   // unit
  Eigen::Vector2d normal;  // unit, outwards
  double length;
  double smallest[2];  // panel lengths at which refinement towards its ends stops
};

struct Nodes {
  std::vector<Eigen::Vector2d> point;
  std::vector<Eigen::Vector2d> normal;
  std::vector<double> weight;
};

double distance_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Side& side) {
  // Panels and sides do not cross: the distance is attained at an end of one of the two.
  const auto to_segment = [](const Eigen::Vector2d& p, const Eigen::Vector2d& s,
                             const Eigen::Vector2d& e) {
    const Eigen::Vector2d d = e - s;
    return (p - s - std::clamp((p - s).dot(d) / d.squaredNorm(), 0.0, 1.0) * d).norm();
  };
  const Eigen::Vector2d end = side.start + side.length * side.along;
  return std::min({to_segment(a, side.start, end), to_segment(b, side.start, end),
                   to_segment(side.start, a, b), to_segment(end, a, b)});
}

/// @param missed  part of J that the panels at a corner, of size h, may miss. Near an inner angle
/// a, psi has a part r^(pi/a) times the turn of the outline there, which costs h^(2 pi/a), and a
/// linear part, h^3
std::vector<Side> sides_of(const Profile& profile, const AreaMoments& moments, double scale,
                           double missed) {
  std::vector<Side> result;
  std::vector<const Polygon*> polygons{&profile.outline};
  for (const Polygon& hole : profile.holes) polygons.push_back(&hole);
  for (const Polygon* polygon : polygons) {
    const std::size_t first = result.size(), n = polygon->size();
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d a = ((*polygon)[i] - moments.centroid) / scale;
      const Eigen::Vector2d b = ((*polygon)[(i + 1) % n] - moments.centroid) / scale;
      const double length = (b - a).norm();
      const Eigen::Vector2d t = (b - a) / length;
      result.push_back({a, t, {t.y(), -t.x()}, length, {0, 0}});
    }
    for (std::size_t i = 0; i < n; ++i) {
      Side& before = result[first + i];
      Side& after = result[first + (i + 1) % n];
      const double turn =
          std::atan2(before.along.x() * after.along.y() - before.along.y() * after.along.x(),
                     before.along.dot(after.along));
      const double power = std::min(kFullTurn / (0.5 * kFullTurn - turn), 3.0);
      before.smallest[1] = after.smallest[0] =
          std::pow(missed / std::max(turn * turn, missed), 1 / power);
    }
  }
  return result;
}

/// Panels no longer than their distance from other sides.
void add_panels(const std::vector<Side>& sides, std::size_t own, double from, double to,
                const GaussLegendre& rule, Nodes& nodes) {
  const Side& side = sides[own];
  const double length = to - from;
  const Eigen::Vector2d a = side.start + from * side.along, b = side.start + to * side.along;
  const double tiny = 1e-13 * side.length;
  const bool at_end = (from <= tiny && length <= side.smallest[0]) ||
                      (to >= side.length - tiny && length <= side.smallest[1]);
  bool close = false;
  for (std::size_t j = 0; j < sides.size() && !close && !at_end; ++j)
    close = j != own && distance_between(a, b, sides[j]) < 0.99 * length;
  // Both ends near a corner: a whole side is never one panel.
  if (close || length > 0.5 * side.length) {
    const double middle = 0.5 * (from + to);
    add_panels(sides, own, from, middle, rule, nodes);
    add_panels(sides, own, middle, to, rule, nodes);
    return;
  }
  for (std::size_t k = 0; k < rule.points.size(); ++k) {
    nodes.point.push_back(a + rule.points[k] * length * side.along);
    nodes.normal.push_back(side.normal);
    nodes.weight.push_back(rule.weights[k] * length);
  }
}

double normal_slope(const Eigen::Vector2d& p, const Eigen::Vector2d& n) {
  return p.y() * n.x() - p.x() * n.y();
}

/// Single layer of d psi/d n, which is linear along every side: in closed form.
double single_layer(const std::vector<Side>& sides, const Eigen::Vector2d& x) {
  double sum = 0;
  for (const Side& side : sides) {
    const Eigen::Vector2d d = x - side.start;
    const double along = d.dot(side.along), across = std::abs(d.dot(side.normal));
    const double value = normal_slope(side.start, side.normal);
    const double slope = normal_slope(side.along, side.normal);
    const double here = value + slope * along;
    const auto primitive = [&](double v) {
      const double r2 = v * v + across * across;
      if (r2 == 0) return 0.0;
      const double log = std::log(r2);
      return here * (0.5 * v * log - v + across * std::atan2(v, across)) +
             slope * 0.25 * r2 * (log - 1);
    };
    sum += primitive(side.length - along) - primitive(-along);
  }
  return -sum / kFullTurn;
}

double perimeter_of(const Profile& profile) {
  double sum = 0;
  const auto add = [&](const Polygon& polygon) {
    for (std::size_t i = 0; i < polygon.size(); ++i)
      sum += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
  };
  add(profile.outline);
  for (const Polygon& hole : profile.holes) add(hole);
  return sum;
}

/// Values on a panel to slopes at its start, its points and its end, over the panel's length.
Eigen::MatrixXd slopes_on_panel(const GaussLegendre& rule) {
  const auto n = static_cast<Eigen::Index>(rule.points.size());
  const auto point = [&](Eigen::Index k) { return rule.points[static_cast<std::size_t>(k)]; };
  Eigen::MatrixXd result(n + 2, n);
  for (Eigen::Index row = 0; row < n + 2; ++row) {
    const double x = row == 0 ? 0 : row > n ? 1 : point(row - 1);
    for (Eigen::Index k = 0; k < n; ++k) {  // derivative of the Lagrange polynomial of point k
      double sum = 0;
      for (Eigen::Index m = 0; m < n; ++m) {
        if (m == k) continue;
        double product = 1 / (point(k) - point(m));
        for (Eigen::Index j = 0; j < n; ++j)
          if (j != k && j != m) product *= (x - point(j)) / (point(k) - point(j));
        sum += product;
      }
      result(row, k) = sum;
    }
  }
  return result;
}

/// The largest |d psi/d s + x t_y - y t_x| along the boundary: the shear there follows the outline.
/// Ends of panels count but at corners, where the shear is zero and psi is no polynomial.
double largest_shear(const std::vector<Side>& sides, const Nodes& nodes, const GaussLegendre& rule,
                     const Eigen::VectorXd& psi) {
  const auto order = static_cast<Eigen::Index>(rule.points.size());
  const Eigen::MatrixXd slopes = slopes_on_panel(rule);
  double largest = 0;
  std::size_t side = 0;
  double at = 0;  // along the side
  for (Eigen::Index first = 0; first < psi.size(); first += order) {
    double length = 0;
    for (Eigen::Index k = 0; k < order; ++k)
      length += nodes.weight[static_cast<std::size_t>(first + k)];
    const Eigen::VectorXd slope = slopes * psi.segment(first, order) / length;
    const Side& own = sides[side];
    const double rotation = own.start.x() * own.along.y() - own.start.y() * own.along.x();
    const double tiny = 1e-9 * own.length;
    for (Eigen::Index row = 0; row < slope.size(); ++row) {
      const bool corner =
          (row == 0 && at <= tiny) || (row == order + 1 && at + length >= own.length - tiny);
      if (!corner) largest = std::max(largest, std::abs(slope[row] + rotation));
    }
    at += length;
    if (at >= own.length - tiny) {
      ++side;
      at = 0;
    }
  }
  return largest;
}

bool is_convex(const std::vector<Side>& sides, const Profile& profile) {
  if (!profile.holes.empty()) return false;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Eigen::Vector2d &a = sides[i].along, &b = sides[(i + 1) % sides.size()].along;
    if (a.x() * b.y() - a.y() * b.x() < -1e-9) return false;
  }
  return true;
}

struct Solved {
  double product = 0;  // boundary integral of psi d psi/d n
  double shear = 0;    // largest on the boundary
  int unknowns = 0;
};

Nodes place_nodes(const std::vector<Side>& sides, const GaussLegendre& rule) {
  Nodes nodes;
  for (std::size_t i = 0; i < sides.size(); ++i)
    add_panels(sides, i, 0, sides[i].length, rule, nodes);
  constexpr std::size_t kMaxNodes = 8000;  // 512 MB of matrix
  if (nodes.point.size() > kMaxNodes) {
    throw Error(ErrorCode::kLimitExceeded, "section.outer",
                fmt::format("the torsion problem of this section needs {} points, more than {}: "
                            "too many vertices or walls too thin",
                            nodes.point.size(), kMaxNodes));
  }
  return nodes;
}

/// Relative residuals of the discretised equation. The iteration aims at the first, close to
/// rounding. The second is accepted, well below the 1e-6 that `torsion` promises of J. Not tuned.
constexpr double kLinearTolerance = 1e-14, kMaxLinearResidual = 1e-10;

Solved solve(const std::vector<Side>& sides, int order) {
  const GaussLegendre rule = gauss_legendre(order);
  const Nodes nodes = place_nodes(sides, rule);
  const auto n = static_cast<Eigen::Index>(nodes.point.size());
  // sum_j k_ij (psi_j - psi_i) + mean psi = single layer: constants are solutions of the
  // homogeneous equation, also of this discretisation, and the mean picks one.
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor matrix(n, n);
  Eigen::VectorXd right(n), slope(n);
  const Eigen::Map<const Eigen::VectorXd> weight(nodes.weight.data(), n);
  const double perimeter = weight.sum();
  parallel_for(n, 64, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      const Eigen::Vector2d x = nodes.point[static_cast<std::size_t>(i)];
      double row = 0;
      for (std::size_t j = 0; j < nodes.point.size(); ++j) {
        const Eigen::Vector2d d = nodes.point[j] - x;
        const double r2 = d.squaredNorm();
        const double k =
            r2 > 0 ? -d.dot(nodes.normal[j]) / (kFullTurn * r2) * nodes.weight[j] : 0.0;
        row += k;
        matrix(i, static_cast<Eigen::Index>(j)) = k + nodes.weight[j] / perimeter;
      }
      matrix(i, i) -= row;
      right[i] = single_layer(sides, x);
      slope[i] = normal_slope(x, nodes.normal[static_cast<std::size_t>(i)]);
    }
  });
  const auto product = [&](const Eigen::VectorXd& v) {
    Eigen::VectorXd result(n);
    parallel_for(n, 128, [&](std::int64_t begin, std::int64_t end) {
      result.segment(begin, end - begin).noalias() = matrix.middleRows(begin, end - begin) * v;
    });
    return result;
  };
  const GmresResult psi = gmres(product, right, kLinearTolerance);
  if (!(psi.relative_residual <= kMaxLinearResidual)) {
    throw Error(ErrorCode::kNumerical, "section.outer",
                fmt::format("the equations of torsion, {} unknowns, were solved to a relative "
                            "residual of {:.2g} in {} iterations, limit {}: simplify the outline "
                            "or give the section's stiffnesses",
                            n, psi.relative_residual, psi.iterations, kMaxLinearResidual));
  }
  return {(weight.array() * psi.x.array() * slope.array()).sum(),
          largest_shear(sides, nodes, rule, psi.x), static_cast<int>(n)};
}

constexpr int kCoarseOrder = 5, kFineOrder = 7;

/// Part of J that corners may miss at the first attempt, over scale^4. It is less for thin
/// sections, whose J is far below I_p. The value 16 A / L^2 is one for a square.
double first_miss(const Profile& oriented, const AreaMoments& moments) {
  const double thinness = 16 * moments.area / std::pow(perimeter_of(oriented), 2);
  return 1e-9 * thinness * thinness;
}

}  // namespace

void demand_torsion_size(const Profile& profile) {
  const Profile oriented = profile.oriented();
  const AreaMoments moments = area_moments(oriented);
  (void)place_nodes(
      sides_of(oriented, moments, std::sqrt(moments.area), first_miss(oriented, moments)),
      gauss_legendre(kFineOrder));
}

Torsion torsion(const Profile& profile) {
  profile.validate();
  const Profile oriented = profile.oriented();
  const AreaMoments moments = area_moments(oriented);
  const double polar = moments.second.trace();
  const double scale = std::sqrt(moments.area);
  const double unit = std::pow(scale, 4);
  Torsion result;
  double missed = first_miss(oriented, moments);
  for (int attempt = 0; attempt < 3; ++attempt, missed *= 1e-3) {
    const std::vector<Side> sides = sides_of(oriented, moments, scale, missed);
    const Solved coarse = solve(sides, kCoarseOrder), fine = solve(sides, kFineOrder);
    result.constant = polar - unit * fine.product;
    result.relative_error =
        std::abs(fine.product - coarse.product) * unit / std::abs(result.constant);
    result.unknowns = fine.unknowns;
    if (is_convex(sides, oriented)) result.shear = fine.shear * scale;
    if (result.relative_error < 1e-7) break;
  }
  if (!(result.constant > 0) || !(result.relative_error < 1e-6)) {
    throw Error(ErrorCode::kNumerical, "section.outer",
                fmt::format("the torsion constant came out as {} with a relative error of {}",
                            result.constant, result.relative_error));
  }
  return result;
}

}  // namespace limber::rods
