#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <type_traits>

namespace limber::scene::testing {

/// Numbers as the bytes of a little-endian file.
template <class Number>
std::string bytes_of(std::initializer_list<std::type_identity_t<Number>> numbers) {
  std::string bytes;
  for (const Number number : numbers) {
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    bytes.append(raw, sizeof number);
  }
  return bytes;
}

/// A binary glTF file of these two chunks.
inline std::string glb_of(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto number = [](std::size_t value) {
    return bytes_of<std::uint32_t>({static_cast<std::uint32_t>(value)});
  };
  return "glTF" + number(2) + number(28 + json.size() + binary.size()) + number(json.size()) +
         "JSON" + json + number(binary.size()) + std::string("BIN\0", 4) + binary;
}

/// Corners of a tetrahedron of volume 1/6, and its faces seen from outside.
inline const std::string kTetrahedronPoints = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
inline constexpr std::initializer_list<int> kTetrahedronFaces = {0, 2, 1, 0, 1, 3,
                                                                 1, 2, 3, 2, 0, 3};

/// JSON of a file whose chunk of bytes has `points` positions, then `corners` indices.
/// @param nodes  entries of the list of nodes; the scene has node 0
/// @param primitive, position, index  further members of the primitive and of its accessors
struct GlbJson {
  std::size_t points = 4, corners = 12, index_bytes = 1;
  std::string nodes = R"({"mesh":0})", primitive = {}, position = {}, top = {};

  [[nodiscard]] std::string text() const {
    const int type = index_bytes == 1 ? 5121 : index_bytes == 2 ? 5123 : 5125;
    const std::string at = std::to_string(12 * points);
    const std::string indices =
        corners == 0 ? ""
                     : R"(,{"bufferView":1,"componentType":)" + std::to_string(type) +
                           R"(,"type":"SCALAR","count":)" + std::to_string(corners) + "}";
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes +
           R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0})" +
           (corners == 0 ? "" : R"(,"indices":1)") + primitive +
           R"(}]}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
           std::to_string(points) + position + "}" + indices +
           R"(],"bufferViews":[{"buffer":0,"byteLength":)" + at + R"(},{"buffer":0,"byteOffset":)" +
           at + R"(,"byteLength":)" + std::to_string(corners * index_bytes) +
           R"(}],"buffers":[{"byteLength":)" + std::to_string(12 * points + corners * index_bytes) +
           "}]" + top + "}";
  }
};

/// The tetrahedron with indices of one byte.
inline std::string tetrahedron_glb(const GlbJson& json = {}) {
  std::string faces;
  for (const int corner : kTetrahedronFaces) faces += static_cast<char>(corner);
  return glb_of(json.text(), kTetrahedronPoints + faces);
}

}  // namespace limber::scene::testing
