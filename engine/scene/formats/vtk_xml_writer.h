#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "engine/scene/formats/mesh_writers.h"

namespace limber::scene::formats {

/// Builds a VTK XML file: arrays are announced in the XML with their offset and follow as raw
/// bytes, each after its size.
class VtkXmlWriter {
 public:
  /// @param type  of the data set: "UnstructuredGrid", "PolyData"
  explicit VtkXmlWriter(std::string type) : type_(std::move(type)) {}

  void open(const char* tag) { xml_ += std::string("<") + tag + ">\n"; }
  void close(const char* tag) { xml_ += std::string("</") + tag + ">\n"; }

  template <typename Stored, typename Value>
  void array(const char* type, const char* name, int components, std::size_t count,
             const Value& value) {
    xml_ += std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
            "\" NumberOfComponents=\"" + std::to_string(components) +
            "\" format=\"appended\" offset=\"" + std::to_string(data_.size()) + "\"/>\n";
    append(static_cast<std::uint64_t>(count * sizeof(Stored)));
    data_.reserve(data_.size() + count * sizeof(Stored));
    for (std::size_t i = 0; i < count; ++i)
      append(static_cast<Stored>(value(static_cast<Eigen::Index>(i))));
  }

  template <typename Value>
  void reals(Precision precision, const char* name, int components, std::size_t count,
             const Value& value) {
    if (precision == Precision::kFloat32) {
      array<float>("Float32", name, components, count, value);
    } else {
      array<double>("Float64", name, components, count, value);
    }
  }

  /// @param counts  attributes of the piece, e.g. NumberOfPoints="8" NumberOfCells="1"
  [[nodiscard]] std::string finish(const std::string& counts) const {
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + type_ +
           "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<" + type_ +
           ">\n<Piece " + counts + ">\n" + xml_ + "</Piece>\n</" + type_ +
           ">\n<AppendedData encoding=\"raw\">\n_" + data_ + "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  template <typename Number>
  void append(Number number) {
    static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    char bytes[sizeof(Number)];
    std::memcpy(bytes, &number, sizeof(Number));
    data_.append(bytes, sizeof(Number));
  }

  std::string type_;
  std::string xml_;
  std::string data_;
};

}  // namespace limber::scene::formats
