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
    const int node = node_of(structure, element, end);
    if (structure.swing(node).axis >= 0 || !structure.node_axes(node).isIdentity(0)) return false;
  }
  return true;
}

/// Changes of the element's twelve numbers when its unknowns change.
Transform transform(const BeamStructure& structure, const BeamState& state, int element,
                    int count) {
  Transform t = Transform::Zero(12, count);
  int column = 12;
  for (const ElementEnd end : kEnds) {
    const int row = 6 * static_cast<int>(end);
    const int node = node_of(structure, element, end);
    t.block<3, 3>(row, row) = structure.node_axes(node);
    t.block<3, 3>(row + 3, row + 3) =
        structure.spin_axes(node, state.rotations[static_cast<std::size_t>(node)]);
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
    const Matrix3d axes =
        structure.spin_axes(r->node, state.rotations[static_cast<std::size_t>(r->node)]);
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

void add_to_unknowns(const BeamStructure& structure, const BeamState& state, int element,
                     const ElementVector& forces, Eigen::VectorXd& sum) {
  const ElementUnknowns unknowns = unknowns_of(structure, element);
  LocalVector local = forces;
  if (!is_plain(structure, element))
    local = transform(structure, state, element, unknowns.count).transpose() * forces;
  for (int k = 0; k < unknowns.count; ++k)
    sum[unknowns.at[static_cast<std::size_t>(k)]] += local[k];
}

LocalMatrix by_unknowns(const BeamStructure& structure, const BeamState& state, int element,
                        const ElementMatrix& matrix) {
  if (is_plain(structure, element)) return matrix;
  const Transform t = transform(structure, state, element, unknowns_of(structure, element).count);
  return t.transpose() * matrix * t;
}

LocalMatrix local_hessian(const BeamStructure& structure, const BeamState& state, int element,
                          Compression compression, const LocalLoad* load) {
  const ElementEnds ends = structure.ends(state, element);
  ElementMatrix h = element_hessian(structure.constants(element), ends, compression);
  if (load != nullptr) h += load->hessian;
  if (is_plain(structure, element)) return h;
  LocalMatrix result = by_unknowns(structure, state, element, h);
  ElementVector g = element_gradient(structure.constants(element), ends);
  if (load != nullptr) g -= load->forces;
  add_order_of_rotations(structure, state, element, g, result);
  return result;
}

}  // namespace limber::beams
