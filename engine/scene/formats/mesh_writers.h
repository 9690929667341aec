#pragma once

#include <string>

#include "engine/bodies/tet_mesh.h"
#include "engine/scene/formats/precision.h"

namespace limber::scene {

/// The bytes of a .vtu file (VTK XML, binary appended raw data, little-endian): the mesh, its
/// materials as cell data (youngs_modulus, poissons_ratio, density) if it has any.
[[nodiscard]] std::string write_vtu(const bodies::TetMesh& mesh,
                                    Precision precision = Precision::kFloat64);

/// One frame of a motion as a .vtu: points at rest + displacement, and the point data
/// "displacement".
/// @param displacement  3n, 3 * node + axis, in the mesh's unit of length
/// @param precision  see precision_for()
/// @throws Error{kInvalidArgument} for a wrong size
[[nodiscard]] std::string write_vtu_frame(const bodies::TetMesh& mesh,
                                          const Eigen::VectorXd& displacement,
                                          Precision precision = Precision::kFloat32);

/// The text of a .pvd file: which .vtu belongs to which time, for ParaView.
/// @param files  names relative to the .pvd, one per time
/// @throws Error{kInvalidArgument} for different numbers of files and times
[[nodiscard]] std::string write_pvd(const std::vector<std::string>& files,
                                    const std::vector<double>& times);

/// The bytes of a Gmsh MSH 4.1 ASCII file: one volume entity, numbers that read back to the same
/// float64.
[[nodiscard]] std::string write_msh(const bodies::TetMesh& mesh);

}  // namespace limber::scene
