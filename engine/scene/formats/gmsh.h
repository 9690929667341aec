#pragma once

#include <string>

#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/mesh_builder.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene::formats {

/// Facts and steps shared by the versions of the MSH format (Gmsh reference manual, section "MSH
/// file format").
struct GmshElementType {
  const char* name;
  int nodes;
  bool tet;  // of any order: corners come first
};
/// @returns nullptr for a type that is not in the manual.
[[nodiscard]] const GmshElementType* gmsh_element_type(std::int64_t type);

struct GmshHeader {
  double version = 0;
  bool binary = false;
  ByteOrder order = ByteOrder::kLittle;
};

/// Numbers of a MSH file in either encoding; the binary ones are not separated by anything.
class GmshNumbers {
 public:
  GmshNumbers(TextCursor& file, const GmshHeader& header) : file_(file), header_(header) {}
  [[nodiscard]] bool binary() const { return header_.binary; }
  std::int64_t int32(const char* what);
  std::int64_t int64(const char* what);
  double real(const char* what);

 private:
  TextCursor& file_;
  const GmshHeader& header_;
};

/// Goes to the next line "$Name" and returns the name (without the sign); empty at the end of the
/// file.
[[nodiscard]] std::string next_gmsh_section(TextCursor& file);

/// The lines of $PhysicalNames: names of groups of volumes. Up to $EndPhysicalNames, which is left.
void read_gmsh_names(TextCursor& file, MeshBuilder& builder);

[[nodiscard]] MeshReading read_gmsh_2(TextCursor& file, const GmshHeader& header);
[[nodiscard]] MeshReading read_gmsh_4(TextCursor& file, const GmshHeader& header);

}  // namespace limber::scene::formats
