#include "engine/beams/structure/element_unknowns.h"

#include <Eigen/Geometry>

namespace limber::beams {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Transform = Eigen::Matrix<double, 12, Eigen::Dynamic, 0, 12, kMaxElementUnknowns>;

const ReleasedEnd* release_of(const BeamStructure& structure, int element, ElementEnd end) {
  const int r = structure.released(element, end);
  return r < 0 ? nullptr : &structure.released_ends()[static_cast<std::size_t>(r)];
}

int node_of(const BeamStructure& structure, int element, ElementEnd end) {
  const BeamElement& e = structure.model().elements[static_cast<std::size_t>(element)];
  return end == ElementEnd::kStart ? e.start : e.finish;
}

constexpr ElementEnd kEnds[] = {ElementEnd::kStart, ElementEnd::kFinish};

bool is_plain(const BeamStructure& structure, int element) {
  for (const ElementEnd end : kEnds) {
    if (release_of(structure, element, end) != nullptr) return false;
    if (!structure.node_axes(node_of(structure, element, end)).isIdentity(0)) return false;
  }
  return true;
}

/// What the element's twelve do when its unknowns change.
Transform transform(const BeamStructure& structure, const BeamState& state, int element,
                    int count) {
  Transform t = Transform::Zero(12, count);
  int column = 12;
  for (const ElementEnd end : kEnds) {
    const int row = 6 * static_cast<int>(end);
    const Matrix3d& axes = structure.node_axes(node_of(structure, element, end));
    t.block<3, 3>(row, row) = axes;
    t.block<3, 3>(row + 3, row + 3) = axes;
    if (const ReleasedEnd* r = release_of(structure, element, end)) {
      const Matrix3d turned = structure.turned_axes(state, *r);
      t.block(row + 3, column, 3, r->axes) = turned.leftCols(r->axes);
      column += r->axes;
    }
  }
  return t;
}

/// Rotations of a released end follow each other, exp(spin) exp(angle_1) exp(angle_2), and do not
/// commute: the moment works on half their cross products.
void add_order_of_rotations(const BeamStructure& structure, const BeamState& state, int element,
                            const ElementVector& gradient, LocalMatrix& h) {
  int column = 12;
  for (const ElementEnd end : kEnds) {
    const ReleasedEnd* r = release_of(structure, element, end);
    if (r == nullptr) continue;
    const int row = 6 * static_cast<int>(end) + 3;
    const Vector3d moment = gradient.segment<3>(row);
    const Matrix3d turned = structure.turned_axes(state, *r);
    const Matrix3d& axes = structure.node_axes(r->node);
    for (int k = 0; k < r->axes; ++k) {
      const Vector3d along = turned.col(k);
      const Vector3d mixed = 0.5 * (axes.transpose() * along.cross(moment));
      h.block<3, 1>(row, column + k) += mixed;
      h.block<1, 3>(column + k, row) += mixed.transpose();
    }
    if (r->axes == 2) {
      const Vector3d first = turned.col(0), second = turned.col(1);
      const double mixed = 0.5 * moment.dot(first.cross(second));
      h(column, column + 1) += mixed;
      h(column + 1, column) += mixed;
    }
    column += r->axes;
  }
}

}  // namespace

ElementUnknowns unknowns_of(const BeamStructure& structure, int element) {
  ElementUnknowns result;
  for (const ElementEnd end : kEnds) {
    const int node = node_of(structure, element, end);
    for (int k = 0; k < 6; ++k)
      result.at[static_cast<std::size_t>(6 * static_cast<int>(end) + k)] = 6 * node + k;
    if (const ReleasedEnd* r = release_of(structure, element, end)) {
      for (int k = 0; k < r->axes; ++k)
        result.at[static_cast<std::size_t>(result.count++)] = r->unknown + k;
    }
  }
  return result;
}

LocalVector local_gradient(const BeamStructure& structure, const BeamState& state, int element) {
  const ElementVector g =
      element_gradient(structure.constants(element), structure.ends(state, element));
  if (is_plain(structure, element)) return g;
  const int count = unknowns_of(structure, element).count;
  return transform(structure, state, element, count).transpose() * g;
}

LocalMatrix local_hessian(const BeamStructure& structure, const BeamState& state, int element,
                          Compression compression) {
  const ElementEnds ends = structure.ends(state, element);
  const ElementMatrix h = element_hessian(structure.constants(element), ends, compression);
  if (is_plain(structure, element)) return h;
  const int count = unknowns_of(structure, element).count;
  const Transform t = transform(structure, state, element, count);
  LocalMatrix result = t.transpose() * h * t;
  const ElementVector g = element_gradient(structure.constants(element), ends);
  add_order_of_rotations(structure, state, element, g, result);
  return result;
}

}  // namespace limber::beams
