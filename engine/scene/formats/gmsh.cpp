#include "engine/scene/formats/gmsh.h"

#include <cmath>

#include "engine/scene/formats/readers.h"

namespace limber::scene::formats {

const GmshElementType* gmsh_element_type(std::int64_t type) {
  static constexpr GmshElementType kTypes[] = {
      {"", 0, false},  // there is no type 0
      {"lines", 2, false},
      {"triangles", 3, false},
      {"quadrangles", 4, false},
      {"tetrahedra", 4, true},
      {"hexahedra", 8, false},
      {"prisms", 6, false},
      {"pyramids", 5, false},
      {"lines", 3, false},
      {"triangles", 6, false},
      {"quadrangles", 9, false},
      {"tetrahedra", 10, true},
      {"hexahedra", 27, false},
      {"prisms", 18, false},
      {"pyramids", 14, false},
      {"points", 1, false},
      {"quadrangles", 8, false},
      {"hexahedra", 20, false},
      {"prisms", 15, false},
      {"pyramids", 13, false},
      {"triangles", 9, false},
      {"triangles", 10, false},
      {"triangles", 12, false},
      {"triangles", 15, false},
      {"triangles", 15, false},
      {"triangles", 21, false},
      {"lines", 4, false},
      {"lines", 5, false},
      {"lines", 6, false},
      {"tetrahedra", 20, true},
      {"tetrahedra", 35, true},
      {"tetrahedra", 56, true},
  };
  if (type < 1 || type >= static_cast<std::int64_t>(std::size(kTypes))) return nullptr;
  return &kTypes[type];
}

std::int64_t GmshNumbers::int32(const char* what) {
  if (!header_.binary) return file_.integer(what);
  return decode<std::int32_t>(file_.bytes(4, what).data(), header_.order);
}

std::int64_t GmshNumbers::int64(const char* what) {
  if (!header_.binary) return file_.integer(what);
  return decode<std::int64_t>(file_.bytes(8, what).data(), header_.order);
}

double GmshNumbers::real(const char* what) {
  if (!header_.binary) return file_.real(what);
  return decode<double>(file_.bytes(8, what).data(), header_.order);
}

std::string next_gmsh_section(TextCursor& file) {
  while (file.skip_blanks()) {
    if (file.peek() == '$') {
      std::string_view line;
      file.next_line(line);
      return std::string(trim(line.substr(1)));
    }
    file.skip_line();
  }
  return {};
}

void read_gmsh_names(TextCursor& file, MeshBuilder& builder) {
  constexpr std::int64_t kVolume = 3;
  constexpr std::size_t kBytesOfName = 128;
  const std::int64_t count = file.count("the number of physical names", 6);
  for (std::int64_t i = 0; i < count; ++i) {
    const std::int64_t dimension = file.integer("the dimension of a physical name");
    const std::int64_t number = file.integer_in_line("the number of a physical name");
    std::string_view rest;
    file.next_line(rest);
    rest = trim(rest);
    if (rest.size() >= 2 && rest.front() == '"' && rest.back() == '"')
      rest = rest.substr(1, rest.size() - 2);
    if (dimension == kVolume && !rest.empty())
      builder.name_group(number, std::string(rest.substr(0, kBytesOfName)));
  }
}

MeshReading read_gmsh(TextCursor& file) {
  file.expect("$MeshFormat");
  GmshHeader header;
  header.version = file.real("a version");
  const std::int64_t kind = file.integer("the file type (0 or 1)");
  const std::int64_t data_size = file.integer("the data size");
  if (kind != 0 && kind != 1) file.fail("the file type is neither 0 (ASCII) nor 1 (binary)");
  file.skip_line();
  header.binary = kind == 1;
  if (header.binary) {
    if (data_size != 8)
      file.fail_at(file.line(),
                   "binary data of size " + std::to_string(data_size) + " are not supported (8 is)",
                   ErrorCode::kUnsupported);
    const char* one = file.bytes(4, "the byte order mark").data();
    if (decode<std::int32_t>(one, ByteOrder::kLittle) != 1) {
      header.order = ByteOrder::kBig;
      if (decode<std::int32_t>(one, ByteOrder::kBig) != 1)
        file.fail("the byte order mark is not 1");
    }
  }
  if (next_gmsh_section(file) != "EndMeshFormat") file.fail("expected '$EndMeshFormat'");
  if (header.version >= 2.0 && header.version < 3.0) return read_gmsh_2(file, header);
  if (std::abs(header.version - 4.1) < 1e-6) return read_gmsh_4(file, header);
  file.fail_at(2,
               "MSH version " + std::to_string(header.version).substr(0, 3) +
                   " is not supported (1, 2.x and 4.1 are)",
               ErrorCode::kUnsupported);
}

}  // namespace limber::scene::formats
