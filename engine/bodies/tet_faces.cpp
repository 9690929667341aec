#include "engine/bodies/tet_faces.h"

#include <algorithm>
#include <climits>
#include <tuple>
#include <utility>

#include "engine/base/error.h"

namespace limber::bodies {

std::vector<TetFace> sorted_faces(const TetNodes& tets) {
  if (tets.cols() > INT_MAX / 4) {
    throw Error(ErrorCode::kLimitExceeded, "mesh.tets", "the mesh has too many tets");
  }
  std::vector<TetFace> faces;
  faces.reserve(static_cast<std::size_t>(tets.cols()) * 4);
  for (int e = 0; e < tets.cols(); ++e) {
    for (int f = 0; f < 4; ++f) {
      const auto& corners = kTetFaces[f];
      std::array<int, 3> nodes = {tets(corners[0], e), tets(corners[1], e), tets(corners[2], e)};
      bool even = true;
      const auto order = [&](int& a, int& b) {
        if (a <= b) return;
        std::swap(a, b);
        even = !even;
      };
      order(nodes[0], nodes[1]);
      order(nodes[1], nodes[2]);
      order(nodes[0], nodes[1]);
      faces.push_back({nodes, 4 * e + f, even});
    }
  }
  std::sort(faces.begin(), faces.end(), [](const TetFace& a, const TetFace& b) {
    return std::tie(a.nodes, a.id) < std::tie(b.nodes, b.id);
  });
  return faces;
}

}  // namespace limber::bodies
