#include "engine/session/linkages/statics.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "engine/base/error.h"

namespace limber::session {
namespace {

rods::RodMaterial material_of(const scene::Linkage& linkage) {
  const double unit = linkage.length_unit_in_metres;
  return {linkage.youngs_modulus * unit * unit, linkage.poissons_ratio};
}

}  // namespace

LinkageStatics::LinkageStatics(const MappedLinkage& mapped, const scene::Linkage& linkage)
    : mapped_(mapped),
      stresses_(linkage.section, mapped.section, material_of(linkage), linkage.stiff_axis),
      length_unit_(linkage.length_unit_in_metres) {
  for (int s = 0; s < model().variables().segments(); ++s) edges_ += model().variables().edges(s);
}

bool LinkageStatics::by_edges() const {
  constexpr double kSame = 1e-12;
  const Eigen::VectorXd edges = model().edge_lengths();
  try {
    const rods::RestLengths spread = model().rest_length_map().apply(model().segment_lengths());
    return !edges.isApprox(model().edge_numbers().listed(spread), kSame);
  } catch (const Error&) {  // spread evenly, they would leave nothing between joints
    return true;
  }
}

Eigen::VectorXf LinkageStatics::strains(const rods::LinkageState& state) const {
  const rods::LinkageStrains strains = rods::linkage_strains(model(), state);
  Eigen::VectorXf packed(strains.axial.size() + strains.turning.size());
  packed << strains.axial.cast<float>(),
      Eigen::Map<const Eigen::VectorXd>(strains.turning.data(), strains.turning.size())
          .cast<float>();
  return packed;
}

LinkageDetail LinkageStatics::detail(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                                     const Eigen::Ref<const Eigen::VectorXf>& strains) const {
  const rods::ReducedVariables& variables = model().variables();
  const Eigen::Index turning = 3 * (Eigen::Index{edges_} - variables.segments());
  LIMBER_DEMAND(strains.size() == edges_ + turning);
  rods::LinkageStrains unpacked;
  unpacked.axial = strains.head(edges_).cast<double>();
  unpacked.turning = strains.tail(turning).cast<double>().reshaped(3, turning / 3);
  rods::LinkageStresses stresses = stresses_.evaluate(model(), unpacked);
  LinkageDetail detail;
  detail.fields = std::move(stresses.stations);
  detail.first = std::move(stresses.first);
  detail.fields.middleRows<3>(rods::kBendingMoment1) *= length_unit_;
  detail.fields.middleRows<4>(rods::kLargestNormal) /= length_unit_ * length_unit_;
  Eigen::Index edge = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    LinkageDetail::Segment& segment = detail.segments.emplace_back();
    segment.section_scale = model().section_scales()[s];
    segment.joints = model().graph().segments[static_cast<std::size_t>(s)].joints;
    const int edges = variables.edges(s);
    for (int e = 0; e < edges; ++e) {
      const bool terminal = (e == 0 && segment.joints[rods::kStart] >= 0) ||
                            (e == edges - 1 && segment.joints[rods::kFinish] >= 0);
      const double rest =
          (terminal ? 0.5 : 1.0) * model().rest_lengths().edge(model().graph(), variables, s, e);
      segment.rest_length += rest;
      segment.length += rest * (1 + unpacked.axial[edge++]);
    }
  }
  place(coordinates, detail);
  return detail;
}

/// Points and frames of stations and joints: what the coordinates say.
void LinkageStatics::place(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                           LinkageDetail& detail) const {
  detail.joints.resize(model().graph().joints.size());
  detail.points.resize(3, stations());
  detail.directors.resize(3, stations());
  Eigen::Index from = 0, station = 0;
  for (std::size_t s = 0; s < detail.segments.size(); ++s) {
    const int edges = model().variables().edges(static_cast<int>(s));
    const auto vertex = [&](int i) -> Eigen::Vector3d {
      return coordinates.segment<3>(from + 3 * Eigen::Index{i});
    };
    const auto director = [&](int e) -> Eigen::Vector3d {
      return coordinates.segment<3>(from + 3 * Eigen::Index{edges + 1 + e});
    };
    for (int i = 0; i <= edges; ++i, ++station) {
      detail.points.col(station) = vertex(i);
      detail.directors.col(station) =
          (director(std::max(i - 1, 0)) + director(std::min(i, edges - 1))).normalized();
    }
    for (const int end : {0, 1}) {
      const int joint = detail.segments[s].joints[static_cast<std::size_t>(end)];
      if (joint < 0) continue;
      const int edge = end == 0 ? 0 : edges - 1;
      const Eigen::Vector3d centre = 0.5 * (vertex(edge) + vertex(edge + 1));
      detail.points.col(end == 0 ? station - edges - 1 : station - 1) = centre;
      LinkageDetail::Joint& placed = detail.joints[static_cast<std::size_t>(joint)];
      placed.position = centre;
      placed.normal = (vertex(edge + 1) - vertex(edge)).cross(director(edge)).normalized();
    }
    from += 6 * Eigen::Index{edges} + 3;
  }
  for (auto& joint : detail.joints) joint.opening_angle = coordinates[from++];
  LIMBER_DEMAND(from == coordinates.size());
}

}  // namespace limber::session
