#include "tests/support/rod_problems.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tests/support/dense.h"

namespace limber::testing {

using namespace rods;

namespace {

Eigen::Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

std::vector<char> free_unknowns(const Rod& rod) {
  return std::vector<char>(static_cast<std::size_t>(rod.layout->unknowns()), 0);
}
void hold(std::vector<char>& fixed, int unknown) { fixed[static_cast<std::size_t>(unknown)] = 1; }
void hold_node(std::vector<char>& fixed, int node) {
  for (int c = 0; c < 3; ++c) hold(fixed, 4 * node + c);
}
void clamp_edge(std::vector<char>& fixed, int edge) {
  hold_node(fixed, edge);
  hold_node(fixed, edge + 1);
  hold(fixed, 4 * edge + 3);
}
/// Planar problems: all that leaves the plane z = 0.
void hold_plane(std::vector<char>& fixed) {
  for (std::size_t i = 0; i < fixed.size(); ++i)
    if (i % 4 >= 2) fixed[i] = 1;
}

/// Along x, the given start of the first node.
Eigen::Matrix3Xd straight(int edges, double start, double length_of_edge) {
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  for (int i = 0; i <= edges; ++i) nodes(0, i) = start + i * length_of_edge;
  return nodes;
}

/// Reports of steps that follow each other.
RodReport added(const RodReport& before, const RodReport& last) {
  RodReport result = last;
  result.iterations += before.iterations;
  result.factorizations += before.factorizations;
  return result;
}

Eigen::Matrix3Xd nodes_of(const RodState& state, int edges) {
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i) nodes.col(i) = state.unknowns().segment<3>(4 * i);
  return nodes;
}

constexpr SectionStiffness kInextensible{1e7, 1, 1, 1};  // for rods of length 1

}  // namespace

RodEquilibrium cantilever_shape(int edges, double alpha, double modulus, double length,
                                double height, BendingForm form) {
  const SectionStiffness stiffness =
      section_stiffness(section_properties(Rectangle{height, height}), {modulus, 0.3});
  const double h = length / (edges - 0.5);
  const Rod rod(straight(edges, -0.5 * h, h), stiffness, {.form = form});
  auto fixed = free_unknowns(rod);
  clamp_edge(fixed, 0);
  hold_plane(fixed);
  RodLoads loads;
  loads.forces = Eigen::Matrix3Xd::Zero(3, edges + 1);
  loads.forces(1, edges) = alpha * stiffness.bending_1 / (length * length);
  return find_equilibrium(rod.drawn, rod.parameters, loads, fixed);
}

RodAnswer cantilever(int edges, double alpha, double deflection, double shortening,
                     double slenderness, BendingForm form) {
  const auto found = cantilever_shape(edges, alpha, 1e9, 1, 1 / slenderness, form);
  const Eigen::VectorXd& x = found.at.state().unknowns();
  const Eigen::Vector2d tip = x.segment<2>(4 * edges);
  return {tip.y(), deflection, (tip - Eigen::Vector2d(1 - shortening, deflection)).norm(),
          found.report, nodes_of(found.at.state(), edges)};
}

RodAnswer roll_up(int edges, BendingForm form) {
  // Curvature lives between the middles of the first and the last edge.
  const double h = 1.0 / (edges - 1);
  const Rod rod(straight(edges, -0.5 * h, h), kInextensible, {.form = form});
  auto fixed = free_unknowns(rod);
  clamp_edge(fixed, 0);
  hold_plane(fixed);  // out of the plane, a moment of fixed direction has no potential
  RodLoads loads;
  loads.moments = Eigen::Matrix3Xd::Zero(3, edges + 1);
  // In steps: the circle is the answer along the path, others have turned more or less often.
  constexpr int kSteps = 8;
  RodState state = rod.drawn;
  RodReport report;
  for (int step = 1; step <= kSteps; ++step) {
    loads.moments(2, edges - 1) = 2 * std::numbers::pi * step / kSteps;
    const auto found = find_equilibrium(state, rod.parameters, loads, fixed);
    state = found.at.state();
    report = added(report, found.report);
  }
  const Eigen::VectorXd& x = state.unknowns();
  const Eigen::Vector3d tip = 0.5 * (x.segment<3>(4 * (edges - 1)) + x.segment<3>(4 * edges));
  return {tip.norm(), 0, tip.norm(), report};
}

RodAnswer compressed(int edges, Ends ends, double span, double height, BendingForm form) {
  const double h = ends == Ends::kHinged ? 1.0 / edges : 1.0 / (edges - 1);
  const double start = ends == Ends::kHinged ? 0 : -0.5 * h;
  const Rod rod(straight(edges, start, h), kInextensible, {.form = form});
  auto fixed = free_unknowns(rod);
  hold_plane(fixed);
  if (ends == Ends::kHinged) {
    hold_node(fixed, 0);
    hold_node(fixed, edges);
  } else {
    clamp_edge(fixed, 0);
    clamp_edge(fixed, edges - 1);
  }
  // Start from an arch of the right length and span: slopes vary as a cosine, whose size is found
  // by bisection.
  const auto arch = [&](double slope) {
    Eigen::VectorXd x = rod.drawn.unknowns();
    for (int i = 0; i < edges; ++i) {
      const double s = (i + 0.5) * h + start;
      const double angle = ends == Ends::kHinged ? slope * std::cos(std::numbers::pi * s)
                                                 : slope * std::sin(2 * std::numbers::pi * s);
      x.segment<2>(4 * i + 4) =
          x.segment<2>(4 * i) + h * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    return x;
  };
  const double chord = span + (ends == Ends::kHinged ? 0 : h);
  double low = 0, high = 2.2;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (arch(middle)[4 * edges] - start > chord ? low : high) = middle;
  }
  const Eigen::VectorXd x = arch(low);
  const RodState initial = RodAtSource(rod.drawn).moved(x);
  const auto found = find_equilibrium(initial, rod.parameters, {}, fixed);
  double top = 0;
  for (int i = 1; i <= edges; ++i) {
    const Eigen::VectorXd& y = found.at.state().unknowns();
    top = std::max({top, y[4 * i + 1], 0.5 * (y[4 * i + 1] + y[4 * i - 3])});
  }
  return {top, height, std::abs(top - height) / height, found.report,
          nodes_of(found.at.state(), edges)};
}

RodAnswer forty_five_degree_bend(int edges, double force, double torsion_constant,
                                 const Eigen::Vector3d& expected, BendingForm form) {
  const double radius = 100, modulus = 1e7, step = 0.25 * std::numbers::pi / (edges - 0.5);
  Eigen::Matrix3Xd nodes(3, edges + 1);
  // From the origin along y, bending towards x: the tip is at (29.29, 70.71) there.
  for (int i = 0; i <= edges; ++i) {
    const double phi = (i - 0.5) * step;
    nodes.col(i) << radius * std::sin(phi), radius * (1 - std::cos(phi)), 0;
  }
  const SectionStiffness stiffness{modulus, modulus / 12, modulus / 12,
                                   0.5 * modulus * torsion_constant};
  const Rod rod(nodes, stiffness, {.form = form});
  auto fixed = free_unknowns(rod);
  clamp_edge(fixed, 0);
  RodLoads loads;
  loads.forces = Eigen::Matrix3Xd::Zero(3, edges + 1);
  loads.forces(2, edges) = force;
  const auto found = find_equilibrium(rod.drawn, rod.parameters, loads, fixed);
  const Eigen::Vector3d tip = found.at.state().unknowns().segment<3>(4 * edges);
  return {tip.z(), expected.z(), (tip - expected).norm() / (radius * std::numbers::pi / 4),
          found.report, nodes_of(found.at.state(), edges)};
}

namespace {

constexpr double kHelixLength = 100, kHelixSlack = 3;
constexpr double kHelixMoment = 98.541496, kHelixTension = 2900.9932;  // without dimensions
constexpr double kHelixDepth = 2 - 0.5 * kHelixMoment * kHelixMoment / kHelixTension;

/// The infinite rod's shape: cos of the angle with the axis is 1 - depth sech^2, and the direction
/// turns about the axis. Sampled, with ends on the axis and terminal edges along it.
Eigen::Matrix3Xd helix_nodes(int edges, double h) {
  const double rate = std::sqrt(kHelixTension - 0.25 * kHelixMoment * kHelixMoment) / kHelixLength;
  const auto tangent = [&](double s) {
    const double sech = 1 / std::cosh(rate * s);
    const double cosine = 1 - kHelixDepth * sech * sech, sine = std::sqrt(1 - cosine * cosine);
    const double psi = 0.5 * kHelixMoment * s / kHelixLength +
                       std::atan2(std::tanh(rate * s) * rate, 0.5 * kHelixMoment / kHelixLength);
    return Eigen::Vector3d(cosine, sine * std::cos(psi), sine * std::sin(psi));
  };
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  constexpr int kParts = 200;
  for (int i = 0; i < edges; ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < kParts; ++k)
      sum += tangent((i - 0.5 * (edges - 1) + (k + 0.5) / kParts - 0.5) * h);
    nodes.col(i + 1) = nodes.col(i) + h * sum.normalized();
  }
  const Eigen::Vector3d end(kHelixLength + h - kHelixSlack, 0, 0), gap = nodes.col(edges) - end;
  for (int i = 0; i <= edges; ++i) nodes.col(i) -= gap * i / edges;
  nodes.col(1) = nodes.col(0) + Eigen::Vector3d(h, 0, 0);
  nodes.col(edges) = end;
  nodes.col(edges - 1) = end - Eigen::Vector3d(h, 0, 0);
  return nodes;
}

}  // namespace

RodAnswer localised_helix(int edges, BendingForm form) {
  constexpr double kBending = 1.345, kTorsion = 0.789;
  const double h = kHelixLength / (edges - 1);
  const Eigen::Matrix3Xd nodes = helix_nodes(edges, h);
  Rod rod(nodes, {1e5, kBending, kBending, kTorsion},
          {.rest = RestShape::kStraight, .form = form, .first_director = {0, 1, 0}});
  for (int slot = 0; slot < edges; ++slot) rod.parameters(slot, RodParameters::kRestLength) = h;
  // The last frame stands as the first (a whole number of turns), at the twist nearest to that of
  // the infinite rod.
  const Eigen::Vector3d end = eigen(rod.drawn.frame(edges - 1).d1);
  const double transported = std::atan2(end.z(), end.y());
  const double wanted = kHelixMoment * kBending / kTorsion;
  const double last =
      -transported +
      2 * std::numbers::pi * std::round((wanted + transported) / (2 * std::numbers::pi));
  Eigen::VectorXd x = rod.drawn.unknowns();
  for (int slot = 0; slot < edges; ++slot) x[4 * slot + 3] = last * slot / (edges - 1);
  auto fixed = free_unknowns(rod);
  clamp_edge(fixed, 0);
  clamp_edge(fixed, edges - 1);
  const auto found = find_equilibrium(RodAtSource(rod.drawn).moved(x), rod.parameters, {}, fixed);
  double smallest = 1;
  for (int slot = 0; slot < edges; ++slot)
    smallest = std::min(smallest, found.at.state().frame(slot).tangent.x);
  const double expected = 1 - kHelixDepth;
  return {std::acos(smallest), std::acos(expected),
          std::abs(std::acos(smallest) / std::acos(expected) - 1), found.report};
}

RodAnswer ring_threshold(int edges, BendingForm form) {
  // A ring as an open rod whose last edge lies on the first, each counted half; unknowns of the
  // last nodes are those of the first.
  const double bending = 1, torsion = 0.7;
  Eigen::Matrix3Xd nodes(3, edges + 2);
  for (int i = 0; i < edges + 2; ++i) {
    const double phi = 2 * std::numbers::pi * i / edges;
    nodes.col(i) << std::cos(phi), std::sin(phi), 0;
  }
  Rod rod(nodes, {1e4, bending, bending, torsion}, {.rest = RestShape::kStraight, .form = form});
  rod.parameters(0, RodParameters::kStretching) *= 0.5;
  rod.parameters(edges, RodParameters::kStretching) *= 0.5;
  // A rod bent to a ring is under compression of B / (2 R^2), half taken by shortening: with stiff
  // edges the radius stays.
  const auto negative = [&](double twist) {
    Eigen::VectorXd x = rod.drawn.unknowns();
    for (int slot = 0; slot <= edges; ++slot) x[4 * slot + 3] = twist * slot / edges;
    const RodAtSource at(RodAtSource(rod.drawn).moved(x));
    Eigen::MatrixXd ring = Eigen::MatrixXd::Zero(4 * edges, 4 * edges);
    for_each_entry(*rod.layout, at.hessian(rod.parameters), [&](int row, int column, double value) {
      const int r = row % (4 * edges), c = column % (4 * edges);
      ring(r, c) += value;
      if (row != column) ring(c, r) += value;
    });
    const Eigen::VectorXd spectrum = reference::symmetric_eigenvalues(ring);
    // Softest bending modes of the ring have eigenvalues of about B (2 pi / edges): rounding of the
    // stretching is far below a millionth of that.
    return (spectrum.array() < -1e-5 * bending / edges).count() > 0;
  };
  const double expected = 2 * std::numbers::pi * std::sqrt(3.0) * bending / torsion;
  double low = 0, high = 2 * expected;
  while (!negative(high) && high < 50 * expected) high *= 2;
  for (int step = 0; step < 30; ++step) {
    const double middle = 0.5 * (low + high);
    (negative(middle) ? high : low) = middle;
  }
  return {high, expected, std::abs(high / expected - 1), {}};
}

}  // namespace limber::testing
