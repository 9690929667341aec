#include "engine/rods/linkage/line_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace limber::rods {
namespace {

/// Limit of coordinates: squares of larger ones overflow.
constexpr double kLargestCoordinate = 1e100;

LineMeshFault fault_of_edge(int edge, const std::string& message,
                            ErrorCode code = ErrorCode::kInvalidArgument) {
  return {code, -1, edge, fmt::format("edge {} {} (from 0)", edge, message)};
}

std::optional<LineMeshFault> fault_of_normals(const LineMesh& mesh) {
  if (mesh.normals.cols() == 0) return {};
  LineMeshFault fault;
  if (mesh.normals.cols() != mesh.vertices.cols()) {
    fault.normal = 0;
    fault.message = fmt::format("{} normals are given for {} vertices: one for each is expected",
                                mesh.normals.cols(), mesh.vertices.cols());
    return fault;
  }
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    const double length = mesh.normals.col(v).stableNorm();
    if (length > 0 && length <= kLargestCoordinate) continue;
    fault.normal = v;
    fault.message = fmt::format("normal {} (from 0) must be finite and not zero", v);
    return fault;
  }
  return {};
}

}  // namespace

std::optional<LineMeshFault> fault_of(const LineMesh& mesh) {
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    if ((mesh.vertices.col(v).array().abs() <= kLargestCoordinate).all()) continue;  // NaN is not
    const std::string what = mesh.vertices.col(v).allFinite()
                                 ? fmt::format("beyond {:g}", kLargestCoordinate)
                                 : "that is not finite";
    return LineMeshFault{ErrorCode::kInvalidArgument, v, -1,
                         fmt::format("vertex {} (from 0) has a coordinate {}", v, what)};
  }
  if (mesh.edge_count() == 0)
    return LineMeshFault{.message = "a line mesh needs at least one edge"};
  std::map<std::pair<int, int>, int> known;
  for (int e = 0; e < mesh.edge_count(); ++e) {
    const int a = mesh.edges(0, e);
    const int b = mesh.edges(1, e);
    for (const int v : {a, b}) {
      if (v >= 0 && v < mesh.vertex_count()) continue;
      return fault_of_edge(e, fmt::format("uses vertex {} of {}", v, mesh.vertex_count()),
                           ErrorCode::kOutOfRange);
    }
    if (a == b) return fault_of_edge(e, fmt::format("joins vertex {} with itself", a));
    const auto [other, is_new] = known.emplace(std::minmax(a, b), e);
    if (!is_new) {
      return fault_of_edge(
          e, fmt::format("joins vertices {} and {} as edge {} does", a, b, other->second));
    }
    if (!((mesh.vertices.col(b) - mesh.vertices.col(a)).norm() > 0))
      return fault_of_edge(e, fmt::format("has no length: vertices {} and {} coincide", a, b));
  }
  return fault_of_normals(mesh);
}

void check_line_mesh(const LineMesh& mesh) {
  const std::optional<LineMeshFault> fault = fault_of(mesh);
  if (!fault) return;
  const std::string field = fault->vertex >= 0   ? fmt::format("vertices[{}]", fault->vertex)
                            : fault->edge >= 0   ? fmt::format("edges[{}]", fault->edge)
                            : fault->normal >= 0 ? fmt::format("normals[{}]", fault->normal)
                                                 : "edges";
  throw Error(fault->code, field, fault->message);
}

}  // namespace limber::rods
