#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::scene {

/// A mesh file as uploaded: its name (the ending hints at the format), its bytes, and the files it
/// refers to, by name.
struct MeshFileSet {
  std::string name;
  std::string content;
  std::map<std::string, std::string>
      companions;  // TetGen's other half, VegaFEM includes, one .elastic of materials
};

/// Tets that a file names together: a physical group, an element set, the cells of one number.
struct MeshGroup {
  std::string name;  // its number where the file gives it no name
  std::vector<int> tets;
};

struct MeshReading {
  bodies::TetMesh
      mesh;  // in the file's own unit of length; not yet validated beyond what parsing needs
  /// In the order of their numbers or of the file; a tet may be in several. Empty where all tets
  /// are in one without a name.
  std::vector<MeshGroup> groups;
  std::vector<std::string> warnings;  // skipped or missing data, in words with counts
};

struct MeshReadLimits {
  /// Limit for the data arrays of a .vtu and the data made from them. Compressed arrays can be a
  /// thousand times larger than the file; the data of other formats are a few times the size of the
  /// file.
  std::size_t array_bytes = std::size_t{1} << 30;
};

/// Reads a tetrahedral mesh: Gmsh 1, 2.x and 4.1 (.msh), Medit (.mesh), TetGen (.node + .ele),
/// legacy VTK (.vtk), VTU
/// (.vtu), Abaqus (.inp, .abq), VegaFEM (.veg). The content decides where it can be recognised,
/// else the ending.
///
/// Materials come from *ELASTIC, *DENSITY and *SOLID SECTION (Abaqus), from the cell data
/// youngs_modulus, poissons_ratio and density (.vtk, .vtu) and from VegaFEM's own sections: [Pa]
/// and [kg/m^3]. Material data that are not used cause a warning.
///
/// Nodes keep the order of the file and are counted from 0. Cells other than tets are ignored, with
/// a warning that counts them; for higher-order tets the corners are used. If *INCLUDE lists of a
/// VegaFEM file are not among the companions, it is read without them. Tets that then have no
/// region get the default Material{}; if no tet has one, the mesh has no materials. Both cause
/// warnings.
/// @throws Error{kInvalidArgument} with the file's name as field and "name:line: ..." as message
/// for truncated,
///   inconsistent or non-numeric content and for a file without tets; {kUnsupported} for a format,
///   version or encoding that is not read; {kNotFound} for a missing companion that the mesh needs;
///   {kLimitExceeded} for arrays beyond the limits, and for VegaFEM files that include others
///   so often that twice their bytes (and 1 MiB) are read.
[[nodiscard]] MeshReading read_mesh(const MeshFileSet& files, const MeshReadLimits& limits = {});

/// The same from disk. Companions are found in the same folder: the other half of a TetGen pair
/// (either may be given), the includes of a VegaFEM file, and materials in a file of the same stem
/// ending in .elastic. Use of the latter gives a warning.
/// @throws Error{kIo} if the file cannot be read, {kLimitExceeded} if it has more than `max_bytes`.
[[nodiscard]] MeshReading read_mesh_file(const std::filesystem::path& path,
                                         std::size_t max_bytes = std::size_t{1} << 30,
                                         const MeshReadLimits& limits = {});

/// @throws Error{kIo} or {kLimitExceeded}
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path,
                                     std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace limber::scene
