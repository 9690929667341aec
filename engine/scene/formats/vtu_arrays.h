#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/text_cursor.h"

namespace pugi {
class xml_node;
}

namespace limber::scene::formats {

/// How a VTK XML file keeps its arrays
/// (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html).
struct VtuEncoding {
  ByteOrder order = ByteOrder::kLittle;
  std::size_t header_bytes = 4;  // of the counts before binary data: UInt32 or UInt64
  bool zlib = false;
  bool appended_base64 = false;
  std::string_view appended;  // what follows the '_' of AppendedData
};

/// All numbers of a <DataArray>, from any of its encodings: ascii, inline base64, appended raw or
/// base64, zlib or not.
/// @throws Error through `file` for broken encodings, {kUnsupported} for unknown types.
[[nodiscard]] std::vector<double> read_real_array(const pugi::xml_node& array,
                                                  const VtuEncoding& encoding,
                                                  const TextCursor& file);
[[nodiscard]] std::vector<std::int64_t> read_integer_array(const pugi::xml_node& array,
                                                           const VtuEncoding& encoding,
                                                           const TextCursor& file);

}  // namespace limber::scene::formats
