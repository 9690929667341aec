#include "engine/scene/formats/mesh_writers.h"

#include <charconv>

#include "engine/base/error.h"
#include "engine/scene/formats/vtk_xml_writer.h"

namespace limber::scene {
namespace {

void append_text(std::string& text, double value) {
  char number[32];
  text.append(number, std::to_chars(number, number + sizeof number, value).ptr);
}

std::string vtu_of(const bodies::TetMesh& mesh, const Eigen::VectorXd* displacement,
                   Precision precision) {
  const auto nodes = static_cast<std::size_t>(mesh.node_count()),
             tets = static_cast<std::size_t>(mesh.tet_count());
  formats::VtkXmlWriter vtu("UnstructuredGrid");
  if (displacement != nullptr) {
    vtu.open("PointData Vectors=\"displacement\"");
    vtu.reals(precision, "displacement", 3, 3 * nodes,
              [&](Eigen::Index i) { return (*displacement)[i]; });
    vtu.close("PointData");
  }
  if (!mesh.materials.empty()) {
    const auto material = [&](Eigen::Index t) -> const bodies::Material& {
      return mesh
          .materials[static_cast<std::size_t>(mesh.tet_material[static_cast<std::size_t>(t)])];
    };
    vtu.open("CellData");
    vtu.reals(precision, "youngs_modulus", 1, tets,
              [&](Eigen::Index t) { return material(t).youngs_modulus; });
    vtu.reals(precision, "poissons_ratio", 1, tets,
              [&](Eigen::Index t) { return material(t).poissons_ratio; });
    vtu.reals(precision, "density", 1, tets, [&](Eigen::Index t) { return material(t).density; });
    vtu.close("CellData");
  }
  vtu.open("Points");
  vtu.reals(precision, "Points", 3, 3 * nodes, [&](Eigen::Index i) {
    return mesh.nodes.data()[i] + (displacement != nullptr ? (*displacement)[i] : 0.0);
  });
  vtu.close("Points");
  vtu.open("Cells");
  vtu.array<std::int32_t>("Int32", "connectivity", 1, 4 * tets,
                          [&](Eigen::Index i) { return mesh.tets.data()[i]; });
  vtu.array<std::int32_t>("Int32", "offsets", 1, tets, [](Eigen::Index i) { return 4 * (i + 1); });
  vtu.array<std::uint8_t>("UInt8", "types", 1, tets, [](Eigen::Index) { return 10; });
  vtu.close("Cells");
  return vtu.finish("NumberOfPoints=\"" + std::to_string(mesh.node_count()) +
                    "\" NumberOfCells=\"" + std::to_string(mesh.tet_count()) + "\"");
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace

std::string write_vtu(const bodies::TetMesh& mesh, Precision precision) {
  return vtu_of(mesh, nullptr, precision);
}

std::string write_vtu_frame(const bodies::TetMesh& mesh, const Eigen::VectorXd& displacement,
                            Precision precision) {
  if (displacement.size() != 3 * static_cast<Eigen::Index>(mesh.node_count())) {
    throw Error(ErrorCode::kInvalidArgument, "displacement",
                "the displacement has " + std::to_string(displacement.size()) +
                    " numbers, not 3 per node of " + std::to_string(mesh.node_count()));
  }
  return vtu_of(mesh, &displacement, precision);
}

std::string write_pvd(const std::vector<std::string>& files, const std::vector<double>& times) {
  if (files.size() != times.size()) {
    throw Error(
        ErrorCode::kInvalidArgument, "times",
        std::to_string(times.size()) + " times for " + std::to_string(files.size()) + " files");
  }
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t i = 0; i < files.size(); ++i) {
    text += "<DataSet timestep=\"";
    append_text(text, times[i]);
    text += "\" group=\"\" part=\"0\" file=\"" + escaped(files[i]) + "\"/>\n";
  }
  return text + "</Collection>\n</VTKFile>\n";
}

std::string write_msh(const bodies::TetMesh& mesh) {
  const std::string nodes = std::to_string(mesh.node_count()),
                    tets = std::to_string(mesh.tet_count());
  std::string text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 " + nodes + " 1 " + nodes +
                     "\n3 1 0 " + nodes + "\n";
  for (int i = 1; i <= mesh.node_count(); ++i) text += std::to_string(i) + "\n";
  for (int i = 0; i < mesh.node_count(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      append_text(text, mesh.nodes(axis, i));
      text += axis < 2 ? ' ' : '\n';
    }
  }
  text += "$EndNodes\n$Elements\n1 " + tets + " 1 " + tets + "\n3 1 4 " + tets + "\n";
  for (int t = 0; t < mesh.tet_count(); ++t) {
    text += std::to_string(t + 1);
    for (int corner = 0; corner < 4; ++corner) {
      text += ' ';
      text += std::to_string(mesh.tets(corner, t) + 1);
    }
    text += '\n';
  }
  return text + "$EndElements\n";
}

}  // namespace limber::scene
