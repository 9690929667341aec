#include "engine/scene/formats/polylines.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <pugixml.hpp>

#include "engine/base/error.h"
#include "engine/scene/formats/json_writer.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::scene {
namespace {

Polylines bent_and_straight() {
  Polylines lines;
  lines.points.resize(3, 5);
  lines.points << 0, 1, 2, 0, 1,  //
      0, 0.1, 0, 5, 5,            //
      0, 0, 1.0 / 3, 0, 0;
  lines.lines = {{0, 1, 2}, {3, 4}};
  lines.point_data.push_back({"force", Eigen::RowVectorXf::LinSpaced(5, 0, 4)});
  lines.line_data.push_back({"ends", Eigen::Matrix2f::Identity()});
  return lines;
}

/// Numbers of an array in the appended data of a .vtp.
template <class Number>
std::vector<Number> array_of(const std::string& file, const char* name) {
  const std::size_t data = file.find("<AppendedData");
  pugi::xml_document document;  // raw bytes are no XML: what stands before them is
  EXPECT_TRUE(document.load_string((file.substr(0, data) + "</VTKFile>").c_str()));
  const auto array = document.find_node([&](const pugi::xml_node& node) {
    return std::string(node.attribute("Name").as_string()) == name;
  });
  const std::size_t at = file.find('_', data) + 1 + array.attribute("offset").as_ullong();
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, file.data() + at, sizeof bytes);
  std::vector<Number> values(bytes / sizeof(Number));
  std::memcpy(values.data(), file.data() + at + sizeof bytes, bytes);
  return values;
}

TEST(Polylines, VtpHoldsPointsLinesAndData) {
  const std::string file = write_vtp(bent_and_straight());
  EXPECT_NE(file.find("NumberOfPoints=\"5\""), std::string::npos);
  EXPECT_NE(file.find("NumberOfLines=\"2\""), std::string::npos);
  EXPECT_EQ(array_of<std::int32_t>(file, "connectivity"),
            (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(array_of<std::int32_t>(file, "offsets"), (std::vector<std::int32_t>{3, 5}));
  EXPECT_EQ(array_of<float>(file, "force"), (std::vector<float>{0, 1, 2, 3, 4}));
  EXPECT_EQ(array_of<float>(file, "ends"), (std::vector<float>{1, 0, 0, 1}));
  const auto points = array_of<float>(file, "Points");
  ASSERT_EQ(points.size(), 15u);
  EXPECT_EQ(points[4], 0.1F);
}

TEST(Polylines, ObjIsReadAgain) {
  const Polylines lines = bent_and_straight();
  const rods::LineMesh mesh = read_line_mesh("a.obj", write_obj_lines(lines));
  EXPECT_EQ(mesh.vertices, lines.points);  // to the last bit
  Eigen::Matrix<int, 2, 3> edges;
  edges << 0, 1, 3, 1, 2, 4;
  EXPECT_EQ(mesh.edges, edges);
}

TEST(Polylines, WrongSizesNameTheArray) {
  const auto field = [](const Polylines& lines) {
    try {
      (void)write_vtp(lines);
    } catch (const Error& error) {
      return error.field();
    }
    return std::string();
  };
  Polylines lines = bent_and_straight();
  lines.lines[1][0] = 5;
  EXPECT_EQ(field(lines), "lines");
  lines = bent_and_straight();
  lines.point_data[0].values.resize(1, 4);
  EXPECT_EQ(field(lines), "force");
  lines = bent_and_straight();
  lines.line_data[0].values.resize(2, 3);
  EXPECT_EQ(field(lines), "ends");
}

TEST(JsonWriter, WritesWhatJsonHas) {
  formats::JsonWriter json;
  json.begin_object();
  json.member("a \"b\"\n", "c\\d");
  json.key("list");
  json.begin_array();
  json.value(1);
  json.value(0.1F);
  json.value(0.1);
  json.value(std::numeric_limits<double>::infinity());
  json.value(true);
  json.end_array();
  json.key("empty");
  json.begin_object();
  json.end_object();
  json.key("row");
  json.numbers(Eigen::Vector3f(1, 2.5F, std::numeric_limits<float>::quiet_NaN()));
  json.end_object();
  EXPECT_EQ(
      json.text(),
      "{\n \"a \\\"b\\\"\\u000a\": \"c\\\\d\",\n \"list\": [\n  1,\n  0.1,\n  0.1,\n  null,\n  "
      "true\n ],\n \"empty\": {},\n \"row\": [1, 2.5, null]\n}\n");
}

}  // namespace
}  // namespace limber::scene
