#include "tests/support/beam_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/beams/structure/element_unknowns.h"
#include "tests/support/dense.h"

namespace limber::testing {

using namespace beams;
using std::numbers::pi;

namespace {

constexpr double kLength = 1;
constexpr double kSoft = 1e-4;
// What central differences of forces leave of a scaled second derivative.
constexpr double kDifference = 1e-5;
constexpr double kNoise = 1e-8;

BeamSection section_of_column() {
  BeamMaterial material;
  material.young = 1e10;
  material.poisson = 0.3;
  return make_section(rectangle(0.02, 0.01), material);
}

double weak_bending() {
  const BeamSection s = section_of_column();
  return std::min(s.bending_2, s.bending_3);
}

/// Half of the angle by which the ends of the elastica are turned has this sine.
double modulus_of(double load_ratio) {
  double low = 0, high = 1;
  for (int i = 0; i < 200; ++i) {
    const double k = 0.5 * (low + high);
    const double ratio = std::pow(2 / pi * std::comp_ellint_1(k), 2);
    (ratio < load_ratio ? low : high) = k;
  }
  return 0.5 * (low + high);
}

int add_line(BeamModel& model, double x, int elements, int section) {
  const int first = static_cast<int>(model.nodes.size());
  for (int i = 0; i <= elements; ++i) {
    model.nodes.push_back(
        {Eigen::Vector3d(x, 0, kLength * i / elements), Eigen::Vector3d::UnitX()});
  }
  for (int i = 0; i < elements; ++i) {
    BeamElement e;
    e.start = first + i;
    e.finish = first + i + 1;
    e.section = section;
    model.elements.push_back(e);
  }
  return first;
}

/// Where a fork has swung by half a turn the axes of its spins jump from one side to the other; its
/// support takes no torque there. The gradient's spins are turned back to those of the state.
void by_spins_of(const BeamStructure& structure, const BeamState& state, const BeamState& moved,
                 int element, LocalVector& gradient) {
  const BeamElement& ends = structure.model().elements[static_cast<std::size_t>(element)];
  int first = 3;
  for (const int node : {ends.start, ends.finish}) {
    const auto axes = [&](const BeamState& of) {
      return structure.spin_axes(node, of.rotations[static_cast<std::size_t>(node)]);
    };
    if (structure.has_swung_by_half_a_turn(state, node))
      gradient.segment<3>(first) =
          (axes(state).transpose() * axes(moved) * gradient.segment<3>(first)).eval();
    first += 6;
  }
}

}  // namespace

const char* to_string(ColumnEnds ends) {
  switch (ends) {
    case ColumnEnds::kPinnedPinned:
      return "pinned-pinned";
    case ColumnEnds::kClampedFree:
      return "clamped-free";
    case ColumnEnds::kClampedPinned:
      return "clamped-pinned";
    case ColumnEnds::kClampedGuided:
      return "clamped-guided";
    case ColumnEnds::kClampedClamped:
      return "clamped-clamped";
  }
  return "";
}

double euler_load(ColumnEnds ends) {
  const double unit = weak_bending() / (kLength * kLength);
  switch (ends) {
    case ColumnEnds::kPinnedPinned:
    case ColumnEnds::kClampedGuided:
      return pi * pi * unit;
    case ColumnEnds::kClampedFree:
      return 0.25 * pi * pi * unit;
    case ColumnEnds::kClampedPinned:
      return 20.190728556426629 * unit;  // x^2 of tan x = x
    case ColumnEnds::kClampedClamped:
      return 4 * pi * pi * unit;
  }
  return 0;
}

BeamModel column_model(const Column& column) {
  BeamModel model;
  model.sections = {section_of_column()};
  add_line(model, 0, column.elements, 0);
  const int top = column.elements;
  constexpr bool x = true, o = false;
  const std::array<bool, 6> clamp{x, x, x, x, x, x};
  switch (column.ends) {
    case ColumnEnds::kPinnedPinned:
      model.supports = {{0, {x, x, x, o, o, x}}, {top, {x, x, o, o, o, o}}};
      break;
    case ColumnEnds::kClampedFree:
      model.supports = {{0, clamp}};
      break;
    case ColumnEnds::kClampedPinned:
      model.supports = {{0, clamp}, {top, {x, x, o, o, o, o}}};
      break;
    case ColumnEnds::kClampedGuided:
      model.supports = {{0, clamp}, {top, {o, o, o, x, x, x}}};
      break;
    case ColumnEnds::kClampedClamped:
      model.supports = {{0, clamp}, {top, {x, x, o, x, x, x}}};
      break;
  }
  model.loads = {{top, {0, 0, -column.load * euler_load(column.ends)}}};
  if (column.beside == Beside::kNothing) return model;
  BeamSection soft = section_of_column();
  for (double* value : {&soft.stretching, &soft.torsion, &soft.bending_2, &soft.bending_3})
    *value *= kSoft;
  model.sections.push_back(soft);
  model.supports.push_back({add_line(model, 2 * kLength, 4, 1), clamp});
  return model;
}

double deflection(const Column& column, const BeamState& state) {
  return state.positions.leftCols(column.elements + 1).topRows<2>().colwise().norm().maxCoeff();
}

double elastica_deflection(const Column& column) {
  if (column.load <= 1) return 0;
  // All consist of cantilevers, whose tips are at 2 k / K of their lengths.
  const double k = modulus_of(column.load);
  const double tip = 2 * k / std::comp_ellint_1(k);
  switch (column.ends) {
    case ColumnEnds::kClampedFree:
    case ColumnEnds::kClampedGuided:
      return tip * kLength;  // one; two of half the length, one after the other
    case ColumnEnds::kPinnedPinned:
    case ColumnEnds::kClampedClamped:
      return 0.5 * tip * kLength;  // two beside each other; twice two of a quarter
    case ColumnEnds::kClampedPinned:
      break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

BeamState straight_state(const Column& column) {
  const BeamStructure structure(column_model(column));
  BeamState state = structure.rest_state();
  const double strain = column.load * euler_load(column.ends) / section_of_column().stretching;
  state.positions.row(2).head(column.elements + 1) *= 1 - strain;
  return state;
}

Eigen::VectorXd scaled_eigenvalues(const BeamStructure& structure, const BeamState& state) {
  std::vector<int> row_of(static_cast<std::size_t>(structure.unknowns()), -1);
  int n = 0;
  for (std::size_t u = 0; u < row_of.size(); ++u) {
    if (structure.held()[u] == 0) row_of[u] = n++;
  }
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd increments = Eigen::VectorXd::Zero(structure.unknowns());
  for (int e = 0; e < structure.elements(); ++e) {
    const ElementUnknowns unknowns = unknowns_of(structure, e);
    for (int j = 0; j < unknowns.count; ++j) {
      const int u = unknowns.at[static_cast<std::size_t>(j)];
      const int column = row_of[static_cast<std::size_t>(u)];
      if (column < 0) continue;
      const bool is_length = u < 6 * structure.nodes() && u % 6 < 3;
      const double step = kDifference * (is_length ? structure.constants(e).length : 1.0);
      const auto forces = [&](double by) -> LocalVector {
        increments[u] = by;
        const BeamState moved = structure.moved(state, increments);
        increments[u] = 0;
        LocalVector gradient = local_gradient(structure, moved, e);
        by_spins_of(structure, state, moved, e, gradient);
        return gradient;
      };
      const LocalVector change = (forces(step) - forces(-step)) / (2 * step);
      for (int i = 0; i < unknowns.count; ++i) {
        const int row = row_of[static_cast<std::size_t>(unknowns.at[static_cast<std::size_t>(i)])];
        if (row >= 0) hessian(row, column) += change[i];
      }
    }
  }
  const Eigen::VectorXd scale = hessian.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled =
      scale.asDiagonal() * (0.5 * (hessian + hessian.transpose())) * scale.asDiagonal();
  return reference::symmetric_eigenvalues(scaled);
}

int negative_by_differences(const BeamStructure& structure, const BeamState& state) {
  return static_cast<int>((scaled_eigenvalues(structure, state).array() < -kNoise).count());
}

}  // namespace limber::testing
