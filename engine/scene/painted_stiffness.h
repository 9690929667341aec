#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::scene {

/// What a painted number is.
enum class StiffnessQuantity {
  kFactor,         // of the Young's modulus that the tet has without it
  kYoungsModulus,  // [Pa], in its place
};

/// Stiffness that is painted at one point: a node of a mesh, or a vertex of a surface.
struct PaintedStiffness {
  double value = 1;  // > 0, finite
  StiffnessQuantity quantity = StiffnessQuantity::kFactor;
};

/// Each material of a mesh is split into at most this many. If there are more values, they are
/// rounded to this number, in equal ratios between the least and the greatest one.
inline constexpr int kMaxPaintedMaterials = 256;

/// Gives each tet the geometric mean of its four nodes: half-way between 1 and 100 is 10, whichever
/// of both is the factor of the other. Poisson's ratio and density stay.
/// @param nodes  one for each node of the mesh
/// @param fallback  the material of a mesh that has none
/// @throws Error{kInvalidArgument, "values[i]"} for a value that is not > 0 and finite, "values"
/// for another number of them. Meshes that are not sound stay as they are.
void paint_nodes(const std::vector<PaintedStiffness>& nodes, const bodies::Material& fallback,
                 bodies::TetMesh& mesh);

/// For a mesh that fills a surface. Gives each tet the stiffness painted at the vertex nearest to
/// its centre (the first of several).
/// @param vertices  3 x n, in the mesh's unit
/// @param painted  one for each vertex
void paint_surface(const Eigen::Matrix3Xd& vertices, const std::vector<PaintedStiffness>& painted,
                   const bodies::Material& fallback, bodies::TetMesh& mesh);

}  // namespace limber::scene
