#include "engine/rods/linkage/linkage_strains.h"

#include <vector>

#include "engine/rods/rod/vertex_response.h"

namespace limber::rods {
namespace {

Vec3<double> vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

MaterialFrame<double> frame_of(const LinkageModel& model, const LinkageState& state, int segment,
                               int edge) {
  const Eigen::Vector3d along =
      state.vertex(model, segment, edge + 1) - state.vertex(model, segment, edge);
  const double length = along.norm();
  const Vec3<double> tangent = vec(along / length), d1 = vec(state.director(model, segment, edge));
  return {tangent, length, d1, cross(tangent, d1), {}};
}

Eigen::Vector3d turning_at(const MaterialFrame<double>& before, const MaterialFrame<double>& after,
                           double twist, const LengthWeights<double>& weights, BendingForm form) {
  const VertexMaterial<double> unit{1, 1, 1, weights, {0, 0, 0, 0, 0}};
  const auto strains =
      vertex_response<VertexOrder::kEnergy>(before, after, twist, unit, form).strains;
  const auto stresses = vertex_stresses(strains, unit);
  return {stresses.before_1 + stresses.after_1, stresses.before_2 + stresses.after_2,
          stresses.twist};
}

}  // namespace

LinkageStrains linkage_strains(const LinkageModel& model, const LinkageState& state) {
  const ReducedVariables& variables = model.variables();
  int edges = 0;
  for (int s = 0; s < variables.segments(); ++s) edges += variables.edges(s);
  LinkageStrains result;
  result.axial.resize(edges);
  result.turning.resize(3, edges - variables.segments());
  Eigen::Index edge = 0, vertex = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    MaterialFrame<double> before{};
    double rest_before = 0;
    for (int e = 0; e < variables.edges(s); ++e) {
      const MaterialFrame<double> frame = frame_of(model, state, s, e);
      const double rest = model.rest_lengths().edge(model.graph(), variables, s, e);
      result.axial[edge++] = (frame.length - rest) / rest;
      if (e > 0) {
        result.turning.col(vertex++) =
            turning_at(before, frame, state.twist(model, s, e),
                       length_weights(rest_before, rest, model.form()), model.form());
      }
      before = frame;
      rest_before = rest;
    }
  }
  return result;
}

}  // namespace limber::rods
