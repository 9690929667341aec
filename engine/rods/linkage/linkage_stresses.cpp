#include "engine/rods/linkage/linkage_stresses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/error.h"

namespace limber::rods {

LinkageStressModel::LinkageStressModel(const Section& section, const SectionProperties& properties,
                                       const RodMaterial& material, StiffAxis axis)
    : reach_(section, properties, axis),
      stiffness_(section_stiffness(properties, material, axis)),
      young_modulus_(material.young_modulus),
      shear_factor_(std::numeric_limits<double>::quiet_NaN()) {
  const double shear_modulus = 0.5 * material.young_modulus / (1 + material.poisson_ratio);
  if (properties.torsion_shear) shear_factor_ = shear_modulus * *properties.torsion_shear;
}

LinkageStressModel::Station LinkageStressModel::station(double axial,
                                                        const Eigen::Vector3d& turning,
                                                        double scale) const {
  const double area = scale * scale, inertia = area * area;
  Station result;
  result[kAxialStrain] = axial;
  result[kAxialForce] = area * stiffness_.stretching * axial;
  result.segment<3>(kCurvature1) = turning;
  result[kBendingMoment1] = inertia * stiffness_.bending_1 * turning[0];
  result[kBendingMoment2] = inertia * stiffness_.bending_2 * turning[1];
  result[kTorque] = inertia * stiffness_.torsion * turning[2];
  const SectionReach::Span bent = reach_.along(-scale * turning.head<2>());
  result[kLargestNormal] = young_modulus_ * (axial + bent.most);
  result[kSmallestNormal] = young_modulus_ * (axial + bent.least);
  const double shear = shear_factor_ * scale * std::abs(turning[2]);
  const double normal =
      std::max(std::abs(result[kLargestNormal]), std::abs(result[kSmallestNormal]));
  result[kTorsionShear] = shear;
  result[kVonMises] = std::sqrt(normal * normal + 3 * shear * shear);
  return result;
}

namespace {

/// The line through two values at two places, at another place.
template <class Value>
Value on_line(double place, double near, const Value& at_near, double far, const Value& at_far) {
  return at_near + (place - near) / (far - near) * (at_far - at_near);
}

/// A segment's strains by where they are along it at rest [length].
struct StrainsAlong {
  Eigen::VectorXd vertices;  // x_0 .. x_n
  double from, to;           // its ends: middles of joints' edges, or free ends
  Eigen::VectorXd axial;     // of edges, at their middles
  Eigen::Matrix3Xd turning;  // of x_1 .. x_(n-1)

  [[nodiscard]] Eigen::Index edges() const { return axial.size(); }
  [[nodiscard]] double middle(Eigen::Index edge) const {
    return 0.5 * (vertices[edge] + vertices[edge + 1]);
  }

  /// An edge at a joint is stretched by the mean of both segments of its rod; the edges within this
  /// segment give the value there instead.
  void take_axial_within(const std::array<int, 2>& joints) {
    const Eigen::Index first = joints[kStart] >= 0 ? 1 : 0;
    const Eigen::Index last = edges() - (joints[kFinish] >= 0 ? 2 : 1);
    if (last < first) return;
    const auto at = [&](Eigen::Index edge, Eigen::Index near, Eigen::Index far) {
      if (far < first || far > last) return axial[near];
      return on_line(middle(edge), middle(near), axial[near], middle(far), axial[far]);
    };
    const double start = at(0, first, first + 1), finish = at(edges() - 1, last, last - 1);
    if (first > 0) axial[0] = start;
    if (last + 1 < edges()) axial[edges() - 1] = finish;
  }

  [[nodiscard]] double axial_at(Eigen::Index i) const {
    const Eigen::Index n = edges();
    if (i == 0) return n < 2 ? axial[0] : on_line(from, middle(0), axial[0], middle(1), axial[1]);
    if (i == n) {
      return n < 2 ? axial[0]
                   : on_line(to, middle(n - 1), axial[n - 1], middle(n - 2), axial[n - 2]);
    }
    return 0.5 * (axial[i - 1] + axial[i]);
  }
  [[nodiscard]] Eigen::Vector3d turning_at(Eigen::Index i) const {
    const Eigen::Index n = edges();
    if (i > 0 && i < n) return turning.col(i - 1);
    const Eigen::Index near = i == 0 ? 1 : n - 1, far = i == 0 ? 2 : n - 2;
    if (n < 3) return turning.col(near - 1);
    return on_line<Eigen::Vector3d>(i == 0 ? from : to, vertices[near], turning.col(near - 1),
                                    vertices[far], turning.col(far - 1));
  }
};

}  // namespace

LinkageStresses LinkageStressModel::evaluate(const LinkageModel& model,
                                             const LinkageStrains& strains) const {
  const ReducedVariables& variables = model.variables();
  LIMBER_DEMAND(strains.turning.cols() + variables.segments() == strains.axial.size());
  LinkageStresses result;
  result.stations.resize(kRodFields, strains.axial.size() + variables.segments());
  Eigen::Index edge = 0, vertex = 0, station_index = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    const auto& joints = model.graph().segments[static_cast<std::size_t>(s)].joints;
    StrainsAlong along{Eigen::VectorXd::Zero(edges + 1), 0, 0, strains.axial.segment(edge, edges),
                       strains.turning.middleCols(vertex, edges - 1)};
    for (int e = 0; e < edges; ++e) {
      along.vertices[e + 1] =
          along.vertices[e] + model.rest_lengths().edge(model.graph(), variables, s, e);
    }
    along.from = joints[kStart] >= 0 ? along.middle(0) : 0;
    along.to = joints[kFinish] >= 0 ? along.middle(edges - 1) : along.vertices[edges];
    along.take_axial_within(joints);
    result.first.push_back(static_cast<int>(station_index));
    for (int i = 0; i <= edges; ++i) {
      const bool free_end = (i == 0 && joints[kStart] < 0) || (i == edges && joints[kFinish] < 0);
      const Eigen::Vector3d turning =
          free_end ? Eigen::Vector3d::Zero() : Eigen::Vector3d(along.turning_at(i));
      result.stations.col(station_index++) =
          station(along.axial_at(i), turning, model.section_scales()[s]);
    }
    edge += edges;
    vertex += edges - 1;
  }
  result.first.push_back(static_cast<int>(station_index));
  return result;
}

Eigen::VectorXd largest_stresses(const LinkageStresses& stresses) {
  Eigen::VectorXd largest(static_cast<Eigen::Index>(stresses.first.size()) - 1);
  for (Eigen::Index s = 0; s < largest.size(); ++s) {
    const int first = stresses.first[static_cast<std::size_t>(s)];
    const auto own = stresses.stations.middleCols(
        first, stresses.first[static_cast<std::size_t>(s) + 1] - first);
    const auto von_mises = own.row(kVonMises);
    largest[s] = von_mises.allFinite() ? von_mises.maxCoeff()
                                       : own.middleRows<2>(kLargestNormal).cwiseAbs().maxCoeff();
  }
  return largest;
}

}  // namespace limber::rods
