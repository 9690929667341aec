#include "engine/rods/linkage/linkage_stresses.h"

#include <algorithm>
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
    result.first.push_back(static_cast<int>(station_index));
    for (int i = 0; i <= edges; ++i) {
      const double axial = 0.5 * (strains.axial[edge + std::max(i - 1, 0)] +
                                  strains.axial[edge + std::min(i, edges - 1)]);
      const bool free_end = (i == 0 && joints[kStart] < 0) || (i == edges && joints[kFinish] < 0);
      Eigen::Vector3d turning = Eigen::Vector3d::Zero();
      if (!free_end) turning = strains.turning.col(vertex + std::clamp(i, 1, edges - 1) - 1);
      result.stations.col(station_index++) = station(axial, turning, model.section_scales()[s]);
    }
    edge += edges;
    vertex += edges - 1;
  }
  result.first.push_back(static_cast<int>(station_index));
  return result;
}

}  // namespace limber::rods
