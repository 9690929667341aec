#include "engine/rods/linkage/line_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

[[noreturn]] void refuse_edge(ErrorCode code, int edge, const std::string& message) {
  throw Error(code, fmt::format("edges[{}]", edge), fmt::format("edge {} {}", edge, message));
}

}  // namespace

void check_line_mesh(const LineMesh& mesh) {
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    if (!mesh.vertices.col(v).allFinite()) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("vertices[{}]", v),
                  fmt::format("vertex {} has a coordinate that is not finite", v));
    }
  }
  if (mesh.edge_count() == 0) {
    throw Error(ErrorCode::kInvalidArgument, "edges", "a line mesh needs at least one edge");
  }
  std::map<std::pair<int, int>, int> known;
  for (int e = 0; e < mesh.edge_count(); ++e) {
    const int a = mesh.edges(0, e);
    const int b = mesh.edges(1, e);
    for (const int v : {a, b}) {
      if (v < 0 || v >= mesh.vertex_count()) {
        refuse_edge(ErrorCode::kOutOfRange, e,
                    fmt::format("uses vertex {} of {} (from 0)", v, mesh.vertex_count()));
      }
    }
    if (a == b) {
      refuse_edge(ErrorCode::kInvalidArgument, e, fmt::format("joins vertex {} with itself", a));
    }
    const auto [other, is_new] = known.emplace(std::minmax(a, b), e);
    if (!is_new) {
      refuse_edge(ErrorCode::kInvalidArgument, e,
                  fmt::format("joins vertices {} and {} as edge {} does", a, b, other->second));
    }
    const Eigen::Vector3d difference = mesh.vertices.col(b) - mesh.vertices.col(a);
    if (!(difference.norm() > 0)) {
      refuse_edge(ErrorCode::kInvalidArgument, e,
                  fmt::format("has no length: vertices {} and {} coincide", a, b));
    }
  }
}

}  // namespace limber::rods
