#include "engine/bodies/boundary_surface.h"

#include <algorithm>
#include <array>
#include <vector>

#include "engine/bodies/tet_faces.h"

namespace limber::bodies {
namespace {

struct Face {
  std::array<int, 3> sorted;
  int id;  // 4 * tet + face
};

}  // namespace

SurfaceTriangles boundary_surface(const TetNodes& tets) {
  std::vector<Face> faces;
  faces.reserve(static_cast<std::size_t>(tets.cols()) * 4);
  for (int e = 0; e < tets.cols(); ++e) {
    for (int f = 0; f < 4; ++f) {
      std::array<int, 3> key = {tets(kTetFaces[f][0], e), tets(kTetFaces[f][1], e),
                                tets(kTetFaces[f][2], e)};
      std::sort(key.begin(), key.end());
      faces.push_back({key, 4 * e + f});
    }
  }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return a.sorted < b.sorted; });
  std::vector<int> single;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t j = i + 1;
    while (j < faces.size() && faces[j].sorted == faces[i].sorted) ++j;
    if (j == i + 1) single.push_back(faces[i].id);
    i = j;
  }
  std::sort(single.begin(), single.end());
  SurfaceTriangles triangles(3, static_cast<Eigen::Index>(single.size()));
  for (std::size_t t = 0; t < single.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      triangles(k, static_cast<Eigen::Index>(t)) = tets(kTetFaces[single[t] % 4][k], single[t] / 4);
    }
  }
  return triangles;
}

}  // namespace limber::bodies
