#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace limber::scene {

/// Lines through points, with data of each point and each line. A plain value.
struct Polylines {
  struct Array {
    std::string name;
    Eigen::MatrixXf values;  // components x points, or components x lines
  };
  Eigen::Matrix3Xd points;
  std::vector<std::vector<int>> lines;  // points of each, from 0
  std::vector<Array> point_data;
  std::vector<Array> line_data;
};

/// The bytes of a .vtp file (VTK XML PolyData, binary appended raw data, little-endian; numbers as
/// float32, points far from the origin as float64, see precision_for()).
/// @throws Error{kInvalidArgument} naming an array of a wrong number of columns, or `lines` for a
/// point that is not there
[[nodiscard]] std::string write_vtp(const Polylines& polylines);

/// Wavefront .obj text: a vertex for each point, numbers that read back to the same float64, and an
/// `l` element for each line. Data is left out.
/// @throws Error{kInvalidArgument} naming `lines` for a point that is not there
[[nodiscard]] std::string write_obj_lines(const Polylines& polylines);

}  // namespace limber::scene
