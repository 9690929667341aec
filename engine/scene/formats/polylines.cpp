#include "engine/scene/formats/polylines.h"

#include <charconv>

#include "engine/base/error.h"
#include "engine/scene/formats/vtk_xml_writer.h"

namespace limber::scene {
namespace {

void demand_points(const Polylines& polylines) {
  for (const auto& line : polylines.lines) {
    for (const int point : line) {
      if (point >= 0 && point < polylines.points.cols()) continue;
      throw Error(ErrorCode::kInvalidArgument, "lines",
                  "a line uses point " + std::to_string(point) + " of " +
                      std::to_string(polylines.points.cols()));
    }
  }
}

void add_data(const char* tag, const std::vector<Polylines::Array>& arrays, Eigen::Index count,
              formats::VtkXmlWriter& vtp) {
  vtp.open(tag);
  for (const auto& array : arrays) {
    const Eigen::MatrixXf& values = array.values;
    if (values.cols() != count) {
      throw Error(ErrorCode::kInvalidArgument, array.name,
                  std::to_string(values.cols()) + " values for " + std::to_string(count));
    }
    vtp.array<float>("Float32", array.name.c_str(), static_cast<int>(values.rows()),
                     static_cast<std::size_t>(values.size()),
                     [&](Eigen::Index i) { return values.data()[i]; });
  }
  vtp.close(tag);
}

}  // namespace

std::string write_vtp(const Polylines& polylines) {
  demand_points(polylines);
  const Eigen::Matrix3Xd& points = polylines.points;
  std::vector<int> connectivity, offsets;
  for (const auto& line : polylines.lines) {
    connectivity.insert(connectivity.end(), line.begin(), line.end());
    offsets.push_back(static_cast<int>(connectivity.size()));
  }
  formats::VtkXmlWriter vtp("PolyData");
  add_data("PointData", polylines.point_data, points.cols(), vtp);
  add_data("CellData", polylines.line_data, static_cast<Eigen::Index>(offsets.size()), vtp);
  vtp.open("Points");
  vtp.reals(precision_for(points), "Points", 3, static_cast<std::size_t>(points.size()),
            [&](Eigen::Index i) { return points.data()[i]; });
  vtp.close("Points");
  vtp.open("Lines");
  const auto integers = [&](const char* name, const std::vector<int>& values) {
    vtp.array<std::int32_t>("Int32", name, 1, values.size(),
                            [&](Eigen::Index i) { return values[static_cast<std::size_t>(i)]; });
  };
  integers("connectivity", connectivity);
  integers("offsets", offsets);
  vtp.close("Lines");
  return vtp.finish("NumberOfPoints=\"" + std::to_string(points.cols()) +
                    "\" NumberOfVerts=\"0\" NumberOfLines=\"" + std::to_string(offsets.size()) +
                    "\" NumberOfStrips=\"0\" NumberOfPolys=\"0\"");
}

std::string write_obj_lines(const Polylines& polylines) {
  demand_points(polylines);
  std::string text = "# " + std::to_string(polylines.points.cols()) + " vertices, " +
                     std::to_string(polylines.lines.size()) + " lines\n";
  char number[32];
  const auto append = [&](auto value) {
    text += ' ';
    text.append(number, std::to_chars(number, number + sizeof number, value).ptr);
  };
  for (Eigen::Index i = 0; i < polylines.points.cols(); ++i) {
    text += 'v';
    for (int axis = 0; axis < 3; ++axis) append(polylines.points(axis, i));
    text += '\n';
  }
  for (const auto& line : polylines.lines) {
    text += 'l';
    for (const int point : line) append(point + 1);
    text += '\n';
  }
  return text;
}

}  // namespace limber::scene
