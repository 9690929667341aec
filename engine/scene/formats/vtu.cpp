// VTK XML unstructured grid (.vtu).
#include <algorithm>
#include <pugixml.hpp>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/readers.h"
#include "engine/scene/formats/vtk_cells.h"
#include "engine/scene/formats/vtu_arrays.h"

namespace limber::scene::formats {
namespace {

/// Cuts raw appended data out of the text: it is no XML.
std::string xml_without_appended(std::string_view content, const TextCursor& file,
                                 VtuEncoding& encoding) {
  const std::size_t tag = content.find("<AppendedData");
  if (tag == std::string_view::npos) return std::string(content);
  const std::size_t end_of_tag = content.find('>', tag);
  if (end_of_tag == std::string_view::npos) file.fail("the tag <AppendedData> does not end");
  const std::string_view attributes = content.substr(tag, end_of_tag - tag);
  encoding.appended_base64 = attributes.find("base64") != std::string_view::npos;
  const std::size_t underscore = content.find('_', end_of_tag);
  if (underscore == std::string_view::npos) file.fail("the appended data do not begin with '_'");
  encoding.appended = content.substr(underscore + 1);
  return std::string(content.substr(0, tag)) + "</VTKFile>";
}

pugi::xml_node array_named(const pugi::xml_node& cells, const char* name, const TextCursor& file) {
  const pugi::xml_node array = cells.find_child_by_attribute("DataArray", "Name", name);
  if (!array) file.fail(std::string("a <Piece> has no data array '") + name + "'");
  return array;
}

/// Whether a <Piece> has as many of them as it says, if it does.
bool says_so(const pugi::xml_node& piece, const char* name, std::size_t count) {
  const pugi::xml_attribute said = piece.attribute(name);
  return !said || parse_number<std::size_t>(trim(said.as_string())) == count;
}

/// x y z of every point.
std::vector<double> read_points(const pugi::xml_node& piece, const VtuEncoding& encoding,
                                const TextCursor& file, ArrayBudget& budget) {
  const pugi::xml_node points = piece.child("Points").child("DataArray");
  if (!points) file.fail("a <Piece> has no points");
  std::vector<double> coordinates = read_real_array(points, encoding, file, budget);
  const std::size_t point_count = coordinates.size() / 3;
  if (coordinates.size() % 3 != 0 || !says_so(piece, "NumberOfPoints", point_count)) {
    file.fail("the points are " + std::to_string(coordinates.size()) +
              " numbers, not 3 times NumberOfPoints");
  }
  return coordinates;
}

/// Reads an array of a known name with a number for each cell; others are listed in `unread`.
void read_cell_data(const pugi::xml_node& array, const VtuEncoding& encoding,
                    const TextCursor& file, ArrayBudget& budget, VtkCells& cells,
                    std::vector<std::string>& unread) {
  const std::string name = to_lower(array.attribute("Name").as_string());
  const std::string_view components = array.attribute("NumberOfComponents").as_string("1");
  std::vector<double> values;
  if (is_read_cell_data(name) && parse_number<int>(trim(components)).value_or(2) <= 1)
    values = read_real_array(array, encoding, file, budget);
  if (!values.empty() && values.size() == cells.types.size()) {
    cells.data[name] = std::move(values);
  } else if (!name.empty() && std::find(unread.begin(), unread.end(), name) == unread.end()) {
    unread.push_back(name);
  }
}

void read_piece(const pugi::xml_node& piece, const VtuEncoding& encoding, const TextCursor& file,
                ArrayBudget& budget, MeshBuilder& builder, std::vector<std::string>& unread) {
  const std::vector<double> coordinates = read_points(piece, encoding, file, budget);
  const std::size_t point_count = coordinates.size() / 3;
  budget.take(point_count * MeshBuilder::kBytesOfNode, file);
  const std::int64_t first_node = static_cast<std::int64_t>(builder.node_count());
  builder.reserve_nodes(static_cast<std::int64_t>(point_count));
  for (std::size_t i = 0; i < point_count; ++i) {
    builder.add_node(first_node + static_cast<std::int64_t>(i), coordinates[3 * i],
                     coordinates[3 * i + 1], coordinates[3 * i + 2]);
  }
  const pugi::xml_node xml_cells = piece.child("Cells");
  VtkCells cells;
  const auto read = [&](const char* name) {
    return read_integer_array(array_named(xml_cells, name, file), encoding, file, budget);
  };
  cells.connectivity = read("connectivity");
  cells.ends = read("offsets");
  cells.types = read("types");
  if (cells.types.size() != cells.ends.size() ||
      !says_so(piece, "NumberOfCells", cells.types.size())) {
    file.fail("the numbers of cell types (" + std::to_string(cells.types.size()) +
              ") and offsets (" + std::to_string(cells.ends.size()) + ") are not NumberOfCells");
  }
  for (const pugi::xml_node array : piece.child("CellData").children("DataArray"))
    read_cell_data(array, encoding, file, budget, cells, unread);
  budget.take(cells.types.size() * MeshBuilder::kBytesOfTet, file);
  add_vtk_cells(cells, first_node, static_cast<std::int64_t>(point_count), file, builder);
}

/// Parses the XML into `document` and says how its arrays are encoded.
VtuEncoding parse_vtu(std::string_view content, const TextCursor& file,
                      pugi::xml_document& document) {
  VtuEncoding encoding;
  const std::string xml = xml_without_appended(content, file, encoding);
  const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
  if (!parsed) {
    const auto offset =
        std::clamp<std::ptrdiff_t>(parsed.offset, 0, static_cast<std::ptrdiff_t>(xml.size()));
    file.fail_at(1 + std::count(xml.begin(), xml.begin() + offset, '\n'),
                 std::string("not valid XML: ") + parsed.description());
  }
  const pugi::xml_node root = document.child("VTKFile");
  const std::string type = root.attribute("type").as_string();
  if (type != "UnstructuredGrid") {
    file.fail_at(1, "a VTK file of type " + in_quotes(type) + "; 'UnstructuredGrid' is read",
                 ErrorCode::kUnsupported);
  }
  if (std::string_view(root.attribute("byte_order").as_string()) == "BigEndian")
    encoding.order = ByteOrder::kBig;
  if (std::string_view(root.attribute("header_type").as_string()) == "UInt64")
    encoding.header_bytes = 8;
  const std::string compressor = root.attribute("compressor").as_string();
  encoding.zlib = compressor == "vtkZLibDataCompressor";
  if (!compressor.empty() && !encoding.zlib) {
    file.fail_at(1, "the compressor " + in_quotes(compressor) + " is not supported (zlib is)",
                 ErrorCode::kUnsupported);
  }
  return encoding;
}

}  // namespace

MeshReading read_vtu(const std::string& name, std::string_view content, std::size_t array_bytes) {
  const TextCursor file(name, content);
  pugi::xml_document document;
  const VtuEncoding encoding = parse_vtu(content, file, document);
  MeshBuilder builder(file);
  ArrayBudget budget(array_bytes);
  std::vector<std::string> unread;
  for (const pugi::xml_node piece :
       document.child("VTKFile").child("UnstructuredGrid").children("Piece")) {
    read_piece(piece, encoding, file, budget, builder, unread);
  }
  warn_of_cell_data(unread, builder);
  return builder.finish();
}

Eigen::Matrix3Xd read_vtu_points(const std::string& name, std::string_view content,
                                 std::size_t array_bytes) {
  const TextCursor file(name, content);
  pugi::xml_document document;
  const VtuEncoding encoding = parse_vtu(content, file, document);
  ArrayBudget budget(array_bytes);
  std::vector<double> all;
  for (const pugi::xml_node piece :
       document.child("VTKFile").child("UnstructuredGrid").children("Piece")) {
    const std::vector<double> points = read_points(piece, encoding, file, budget);
    all.insert(all.end(), points.begin(), points.end());
  }
  return Eigen::Map<const Eigen::Matrix3Xd>(all.data(), 3,
                                            static_cast<Eigen::Index>(all.size() / 3));
}

}  // namespace limber::scene::formats
