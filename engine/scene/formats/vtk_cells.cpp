#include "engine/scene/formats/vtk_cells.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace limber::scene::formats {
namespace {

const char* cell_name(std::int64_t type) {
  switch (type) {
    case 1:
    case 2:
      return "points";
    case 3:
    case 4:
    case 21:
    case 35:
    case 68:
      return "lines";
    case 5:
    case 6:
    case 22:
    case 34:
    case 69:
      return "triangles";
    case 7:
      return "polygons";
    case 8:
    case 9:
    case 23:
    case 28:
    case 70:
      return "quadrangles";
    case 11:
    case 12:
    case 25:
    case 29:
    case 33:
    case 72:
      return "hexahedra";
    case 13:
    case 26:
    case 32:
    case 73:
      return "prisms";
    case 14:
    case 27:
    case 74:
      return "pyramids";
    case 42:
      return "polyhedra";
    default:
      return "cells of other types";
  }
}

constexpr std::array<const char*, 6> kYoungs = {"youngs_modulus", "young_modulus", "youngsmodulus",
                                                "young",          "e_modulus",     "e"};
constexpr std::array<const char*, 5> kPoisson = {"poissons_ratio", "poisson_ratio", "poissonsratio",
                                                 "poisson", "nu"};
constexpr std::array<const char*, 2> kDensity = {"density", "rho"};
constexpr std::array<const char*, 11> kGroups = {
    "gmsh:physical", "medit:ref", "material",  "materialids", "material_id", "material_ids",
    "region",        "regions",   "cell_tags", "group",       "abaqus:elset"};

/// The data of the first of these names that the cells have; null: none.
template <std::size_t Count>
const std::vector<double>* data_named(const VtkCells& cells,
                                      const std::array<const char*, Count>& names) {
  for (const char* const name : names) {
    const auto found = cells.data.find(name);
    if (found != cells.data.end()) return &found->second;
  }
  return nullptr;
}

/// Values of cells from cell data: materials and numbers of groups.
class CellValues {
 public:
  explicit CellValues(const VtkCells& cells)
      : youngs_(data_named(cells, kYoungs)),
        poisson_(data_named(cells, kPoisson)),
        density_(data_named(cells, kDensity)),
        groups_(data_named(cells, kGroups)) {}

  [[nodiscard]] bool has_material() const { return youngs_ && poisson_; }
  [[nodiscard]] bool has_parts_of_material() const { return youngs_ || poisson_ || density_; }
  [[nodiscard]] bool has_density() const { return density_ != nullptr; }
  [[nodiscard]] bodies::Material material(std::size_t cell) const {
    bodies::Material material{(*youngs_)[cell], (*poisson_)[cell]};
    if (density_) material.density = (*density_)[cell];
    return material;
  }
  [[nodiscard]] std::int64_t group(std::size_t cell) const {
    constexpr double kLargest = 1e15;
    if (!groups_ || !(std::abs((*groups_)[cell]) <= kLargest)) return MeshBuilder::kNoGroup;
    return std::llround((*groups_)[cell]);
  }

 private:
  const std::vector<double>*youngs_, *poisson_, *density_, *groups_;
};

template <std::size_t Count>
bool is_one_of(const std::string& name, const std::array<const char*, Count>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

bool is_read_cell_data(const std::string& name) {
  return is_one_of(name, kYoungs) || is_one_of(name, kPoisson) || is_one_of(name, kDensity) ||
         is_one_of(name, kGroups);
}

void warn_of_cell_data(const std::vector<std::string>& unread, MeshBuilder& builder) {
  constexpr std::size_t kListed = 10, kBytesOfName = 40;
  std::string names;
  std::size_t count = 0;
  for (const std::string& name : unread) {
    if (name == "gmsh:geometrical" || name == "vtkoriginalcellids") continue;
    if (++count <= kListed) names += (names.empty() ? "" : ", ") + name.substr(0, kBytesOfName);
  }
  if (count == 0) return;
  if (count > kListed) names += ", ...";
  builder.warn(std::to_string(count) + " cell arrays are not read (" + names +
               "): materials are youngs_modulus, poissons_ratio and density");
}

void add_vtk_cells(const VtkCells& cells, std::int64_t first_node, std::int64_t point_count,
                   const TextCursor& file, MeshBuilder& builder) {
  constexpr std::int64_t kTet = 10;
  constexpr std::int64_t kQuadraticTet = 24;
  constexpr std::int64_t kLagrangeTet = 71;
  constexpr std::int64_t kBezierTet = 78;
  const CellValues values(cells);
  if (values.has_parts_of_material() && !values.has_material()) {
    builder.warn(
        "the cell data have a part of a material alone, which is not taken: "
        "youngs_modulus and poissons_ratio are needed");
  } else if (values.has_material() && !values.has_density()) {
    builder.warn("the cell data have no density: 1000 kg/m^3 is taken");
  }
  std::int64_t begin = 0;
  for (std::size_t i = 0; i < cells.types.size(); ++i) {
    const std::int64_t end = cells.ends[i];
    if (end < begin || end > static_cast<std::int64_t>(cells.connectivity.size())) {
      file.fail("cell " + std::to_string(i) + " (from 0) ends at " + std::to_string(end) +
                ", outside of the connectivity");
    }
    const std::int64_t type = cells.types[i];
    if (type != kTet && type != kQuadraticTet && type != kLagrangeTet && type != kBezierTet) {
      builder.ignore_cell(cell_name(type));
    } else {
      if (end - begin < 4 || (type == kTet && end - begin != 4)) {
        file.fail("cell " + std::to_string(i) + " (from 0) is a tetrahedron of " +
                  std::to_string(end - begin) + " points");
      }
      std::array<std::int64_t, 4> nodes{};
      for (std::size_t corner = 0; corner < 4; ++corner) {
        const std::int64_t point = cells.connectivity[static_cast<std::size_t>(begin) + corner];
        if (point < 0 || point >= point_count) {
          file.fail("cell " + std::to_string(i) + " (from 0) uses point " + std::to_string(point) +
                    " of " + std::to_string(point_count));
        }
        nodes[corner] = point + first_node;
      }
      builder.add_tet(static_cast<std::int64_t>(i), nodes, file.line(), values.group(i));
      if (values.has_material()) builder.set_material(builder.tet_count() - 1, values.material(i));
      if (type != kTet) builder.count_curved_tet();
    }
    begin = end;
  }
}

}  // namespace limber::scene::formats
