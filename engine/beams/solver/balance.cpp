#include "engine/beams/solver/balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/index.h"

namespace limber::beams::detail {

Balance::Balance(const BeamStructure& structure) : structure_(structure) {
  const BeamModel& model = structure.model();
  Eigen::Vector3d low = model.nodes[0].position, high = low;
  if (structure.elements() > 0) low = high = model.nodes[index(model.elements[0].start)].position;
  for (int i = 0; i < structure.nodes(); ++i) {
    if (structure.elements() > 0 && !(structure.tributary_length(i) > 0)) continue;
    low = low.cwiseMin(model.nodes[index(i)].position);
    high = high.cwiseMax(model.nodes[index(i)].position);
  }
  extent_ = (high - low).norm();
  farthest_ = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  weights_ = Eigen::VectorXd::Zero(structure.unknowns());
  rounding_ = Eigen::VectorXd::Zero(structure.unknowns());
  arm_.assign(model.nodes.size(), 0);
  std::vector<int> valence(model.nodes.size(), 0);
  double bending = std::numeric_limits<double>::infinity();
  constexpr double kEpsilon =
      16 * std::numeric_limits<double>::epsilon();  // relative rounding of positions
  for (int e = 0; e < structure.elements(); ++e) {
    const BeamElement& element = model.elements[index(e)];
    const BeamSection& s = model.sections[index(element.section)];
    const double length = structure.constants(e).length;
    stiffest_ = std::max(stiffest_, s.stretching / (length * length));
    const double stiff = std::max({s.bending_2, s.bending_3, s.torsion});
    if (element.kind == BeamKind::kBeam) {
      bending = std::min({bending, s.bending_2, s.bending_3});
      thickness_ = std::max(thickness_, std::sqrt(stiff / s.stretching));
    }
    // A chord is a difference of coordinates; angles are good to rounding of directions.
    const double relative = kEpsilon * (1 + farthest_ / length);
    for (const int node : {element.start, element.finish}) {
      rounding_.segment<3>(6 * node).array() += relative * s.stretching;
      rounding_.segment<3>(6 * node + 3).array() +=
          relative * (stiff / length + s.stretching * structure.constants(e).bow);
      arm_[index(node)] += length;
      valence[index(node)] += 1;
    }
  }
  for (int i = 0; i < structure.nodes(); ++i) {
    if (valence[index(i)] > 0) arm_[index(i)] /= valence[index(i)];
    const double length = structure.tributary_length(i), arm = arm_[index(i)];
    weights_.segment<3>(6 * i).setConstant(length);
    weights_.segment<3>(6 * i + 3).setConstant(length * arm * arm);
  }
  for (const ReleasedEnd& r : structure.released_ends()) {
    weights_.segment(r.unknown, r.axes).setConstant(weights_[6 * r.node + 3]);
    rounding_.segment(r.unknown, r.axes).setConstant(rounding_[6 * r.node + 3]);
  }
  softest_ = std::isfinite(bending) ? bending / std::pow(extent_, 4) : 1e-12 * stiffest_;
}

bool Balance::is_force(int unknown) const {
  return unknown < 6 * structure_.nodes() && unknown % 6 < 3;
}

int Balance::node_of(int unknown) const {
  if (unknown < 6 * structure_.nodes()) return unknown < 0 ? -1 : unknown / 6;
  for (const ReleasedEnd& r : structure_.released_ends()) {
    if (unknown >= r.unknown && unknown < r.unknown + r.axes) return r.node;
  }
  return -1;
}

PresentForces Balance::present(const BeamState& state, const NodeLoads& loads) const {
  PresentForces result;
  for (int e = 0; e < structure_.elements(); ++e) {
    const ElementVector g = element_gradient(structure_.constants(e), structure_.ends(state, e));
    result.force = std::max(result.force, g.segment<3>(6).norm());
    result.moment = std::max({result.moment, g.segment<3>(3).norm(), g.segment<3>(9).norm()});
  }
  return present(result, loads);
}

PresentForces Balance::present(PresentForces in_elements, const NodeLoads& loads) const {
  PresentForces result = in_elements;
  const auto widen = [](const Eigen::Matrix3Xd& columns, double& most) {
    if (columns.cols() > 0) most = std::max(most, columns.colwise().norm().maxCoeff());
  };
  widen(loads.forces, result.force);
  widen(loads.following_forces, result.force);
  widen(0.5 * loads.element_forces, result.force);
  widen(0.5 * loads.following_element_forces, result.force);
  widen(loads.moments, result.moment);
  widen(loads.following_moments, result.moment);
  result.force = std::max(result.force, result.moment / extent_);
  result.moment = std::max(result.moment, result.force * thickness_);
  return result;
}

Imbalance Balance::imbalance(const Eigen::VectorXd& residual, const PresentForces& present,
                             Rounding rounding) const {
  Imbalance worst;
  for (int u = 0; u < structure_.unknowns(); ++u) {
    if (structure_.held()[index(u)] != 0) continue;
    const double size = std::abs(residual[u]);
    if (!std::isfinite(size)) return {std::numeric_limits<double>::infinity(), u};
    const double left = rounding == Rounding::kForgiven ? std::max(0.0, size - rounding_[u]) : size;
    if (left == 0) continue;
    const double reference = is_force(u) ? present.force : present.moment;
    const double scaled =
        reference > 0 ? left / reference : std::numeric_limits<double>::infinity();
    if (scaled > worst.scaled) worst = {scaled, u};
  }
  return worst;
}

double Balance::size_of(const Eigen::VectorXd& increments) const {
  double most = 0;
  for (int i = 0; i < structure_.nodes(); ++i)
    most = std::max(most, increments.segment<3>(6 * i + 3).norm());
  for (int e = 0; e < structure_.elements(); ++e) {
    const BeamElement& element = structure_.model().elements[index(e)];
    const Eigen::Vector3d difference =
        structure_.node_axes(element.finish) * increments.segment<3>(6 * element.finish) -
        structure_.node_axes(element.start) * increments.segment<3>(6 * element.start);
    most = std::max(most, difference.norm() / structure_.constants(e).length);
  }
  for (const ReleasedEnd& r : structure_.released_ends())
    most = std::max(most, increments.segment(r.unknown, r.axes).norm());
  return most;
}

}  // namespace limber::beams::detail
