#include "tests/support/independent_beam_energy.h"

#include <cmath>
#include <vector>

#include "tests/support/dense.h"

namespace limber::testing {

using namespace beams;

namespace {

using Real = long double;
using Vector = Eigen::Matrix<Real, 3, 1>;
using Matrix = Eigen::Matrix<Real, 3, 3>;

constexpr Real kStep = 1e-5L;   // of second differences, in lengths of the element and in [rad]
constexpr double kZero = 1e-8;  // of an eigenvalue beside a diagonal of ones

/// Position and attitude of both ends.
struct EndFrames {
  Vector at[2];
  Matrix axes[2];  // columns: the section's
};

/// exp(spin^x), by the sum of its series.
Matrix rotation(const Vector& spin) {
  Matrix cross;
  cross << 0, -spin[2], spin[1], spin[2], 0, -spin[0], -spin[1], spin[0], 0;
  Matrix sum = Matrix::Identity(), term = Matrix::Identity();
  for (int n = 1; n < 20; ++n) {
    term = (term * cross / static_cast<Real>(n)).eval();
    sum += term;
  }
  return sum;
}

/// The vector of the smallest rotation that takes a direction to another.
Vector swing(const Vector& from, const Vector& to) {
  const Vector normal = from.cross(to);
  const Real sine = normal.norm();
  return sine > 0 ? Vector(normal * (std::atan2(sine, from.dot(to)) / sine)) : Vector::Zero();
}

struct Rest {
  Real length, stretching, torsion, bending[2];
};

/// What the element takes for an angle (NOTATION.md). With angles themselves an element that bends
/// by more than 1 rad has other minima.
Real measure(Real angle) { return 3 * std::sin(angle) / (2 + std::cos(angle)); }

Real energy_of(const Rest& rest, const EndFrames& ends) {
  const Vector chord = ends.at[1] - ends.at[0];
  const Vector t = chord / chord.norm();
  Real angle[2][2];  // end, axis 2 or 3: by how much the end is ahead of the chord
  Matrix swung[2];   // the ends' axes, brought onto the chord
  for (int end = 0; end < 2; ++end) {
    const Vector to_chord = swing(ends.axes[end].col(0), t);
    const Real bend = to_chord.norm();
    for (int axis = 0; axis < 2; ++axis)
      angle[end][axis] =
          bend > 0 ? -to_chord.dot(ends.axes[end].col(axis + 1)) * measure(bend) / bend : 0;
    swung[end] = rotation(to_chord) * ends.axes[end];
  }
  const Real turn = std::atan2(swung[0].col(1).cross(swung[1].col(1)).dot(t),
                               swung[0].col(1).dot(swung[1].col(1)));
  const Real twist = 2 * measure(turn / 2);
  Real longer = 0, bending = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const Real a = angle[0][axis], b = angle[1][axis];
    longer += rest.length / 30 * (2 * a * a - a * b + 2 * b * b);
    bending += 2 * rest.bending[axis] / rest.length * (a * a + a * b + b * b);
  }
  const Real stretch = chord.norm() + longer - rest.length;
  return rest.stretching * stretch * stretch / (2 * rest.length) + bending +
         rest.torsion * twist * twist / (2 * rest.length);
}

Rest rest_of(const BeamStructure& structure, int element) {
  const BeamModel& model = structure.model();
  const BeamElement& e = model.elements[static_cast<std::size_t>(element)];
  const BeamSection& s = model.sections[static_cast<std::size_t>(e.section)];
  const Vector drawn = (model.nodes[static_cast<std::size_t>(e.finish)].position -
                        model.nodes[static_cast<std::size_t>(e.start)].position)
                           .cast<Real>();
  return {drawn.norm(), s.stretching, s.torsion, {s.bending_2, s.bending_3}};
}

EndFrames ends_of(const BeamStructure& structure, const BeamState& state, int element) {
  const BeamElement& e = structure.model().elements[static_cast<std::size_t>(element)];
  const Matrix drawn = structure.rest_axes(element).cast<Real>();
  EndFrames ends;
  int end = 0;
  for (const int node : {e.start, e.finish}) {
    ends.at[end] = state.positions.col(node).cast<Real>();
    const Eigen::Quaternion<Real> turned =
        state.rotations[static_cast<std::size_t>(node)].cast<Real>().normalized();
    ends.axes[end++] = turned.toRotationMatrix() * drawn;
  }
  return ends;
}

using Local = Eigen::Matrix<Real, 12, 1>;

EndFrames moved(const EndFrames& ends, const Local& by, const Matrix* node_axes) {
  EndFrames result;
  for (int end = 0; end < 2; ++end) {
    result.at[end] = ends.at[end] + node_axes[end] * by.segment<3>(6 * end);
    result.axes[end] = rotation(node_axes[end] * by.segment<3>(6 * end + 3)) * ends.axes[end];
  }
  return result;
}

/// Second differences by the unknowns of both ends.
Eigen::Matrix<Real, 12, 12> second_differences(const Rest& rest, const EndFrames& ends,
                                               const Matrix* node_axes) {
  Local step;
  for (int i = 0; i < 12; ++i) step[i] = i % 6 < 3 ? kStep * rest.length : kStep;
  const auto energy = [&](int i, int sign_i, int j, int sign_j) {
    Local by = Local::Zero();
    by[i] += static_cast<Real>(sign_i) * step[i];
    by[j] += static_cast<Real>(sign_j) * step[j];
    return energy_of(rest, moved(ends, by, node_axes));
  };
  Eigen::Matrix<Real, 12, 12> result;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j <= i; ++j) {
      result(i, j) =
          (energy(i, 1, j, 1) - energy(i, 1, j, -1) - energy(i, -1, j, 1) + energy(i, -1, j, -1)) /
          (4 * step[i] * step[j]);
      result(j, i) = result(i, j);
    }
  }
  return result;
}

}  // namespace

long double independent_energy(const BeamStructure& structure, const BeamState& state,
                               int element) {
  return energy_of(rest_of(structure, element), ends_of(structure, state, element));
}

int negative_by_independent_energy(const BeamStructure& structure, const BeamState& state) {
  std::vector<int> row_of(static_cast<std::size_t>(structure.unknowns()), -1);
  int n = 0;
  for (std::size_t u = 0; u < row_of.size(); ++u) {
    if (structure.held()[u] == 0) row_of[u] = n++;
  }
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n);
  for (int e = 0; e < structure.elements(); ++e) {
    const BeamElement& element = structure.model().elements[static_cast<std::size_t>(e)];
    const Matrix node_axes[2] = {structure.node_axes(element.start).cast<Real>(),
                                 structure.node_axes(element.finish).cast<Real>()};
    const auto local =
        second_differences(rest_of(structure, e), ends_of(structure, state, e), node_axes);
    const auto row = [&](int i) {
      const int node = i < 6 ? element.start : element.finish;
      return row_of[static_cast<std::size_t>(6 * node + i % 6)];
    };
    for (int i = 0; i < 12; ++i) {
      for (int j = 0; j < 12; ++j) {
        if (row(i) >= 0 && row(j) >= 0) hessian(row(i), row(j)) += static_cast<double>(local(i, j));
      }
    }
  }
  const Eigen::VectorXd scale = hessian.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd values =
      reference::symmetric_eigenvalues(scale.asDiagonal() * hessian * scale.asDiagonal());
  return static_cast<int>((values.array() < -kZero).count());
}

}  // namespace limber::testing
