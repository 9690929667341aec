#include "engine/bodies/boundary_surface.h"

#include <algorithm>
#include <vector>

#include "engine/bodies/tet_faces.h"

namespace limber::bodies {

SurfaceTriangles boundary_surface(const TetNodes& tets) {
  const std::vector<TetFace> faces = sorted_faces(tets);
  std::vector<int> single;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t j = i + 1;
    while (j < faces.size() && faces[j].nodes == faces[i].nodes) ++j;
    if (j == i + 1) single.push_back(faces[i].id);
    i = j;
  }
  std::sort(single.begin(), single.end());
  SurfaceTriangles triangles(3, static_cast<Eigen::Index>(single.size()));
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    const int id = single[static_cast<std::size_t>(t)];
    for (int k = 0; k < 3; ++k) triangles(k, t) = tets(kTetFaces[id % 4][k], id / 4);
  }
  return triangles;
}

}  // namespace limber::bodies
