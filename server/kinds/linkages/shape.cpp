#include "server/kinds/linkages/shape.h"

#include <vector>

#include "server/wire/arrays.h"

namespace limber::server {
namespace {

/// An array that is left out has no rows.
Eigen::Matrix3Xd rows_of(const proto::Array& array, bool is_there, const std::string& field) {
  return is_there ? decode_points(array, field) : Eigen::Matrix3Xd(3, 0);
}

}  // namespace

proto::LinkageShape encode_linkage_shape(const rods::StateNumbers& shape) {
  proto::LinkageShape message;
  std::vector<Eigen::Vector2d> lengths;
  for (const auto& pair : shape.lengths.colwise()) lengths.emplace_back(pair);
  *message.mutable_positions() = encode_points_float64(shape.positions);
  *message.mutable_normals() = encode_points_float64(shape.normals);
  *message.mutable_bisectors() = encode_points_float64(shape.bisectors);
  encode_numbers(shape.opening_angles, *message.mutable_opening_angles());
  *message.mutable_lengths() = encode_polygon(lengths);
  *message.mutable_vertices() = encode_points_float64(shape.vertices);
  *message.mutable_directors() = encode_points_float64(shape.directors);
  encode_numbers(shape.twists, *message.mutable_twists());
  return message;
}

rods::StateNumbers decode_linkage_shape(const proto::LinkageShape& message,
                                        const std::string& field) {
  rods::StateNumbers shape;
  shape.positions = rows_of(message.positions(), message.has_positions(), field + ".positions");
  shape.normals = rows_of(message.normals(), message.has_normals(), field + ".normals");
  shape.bisectors = rows_of(message.bisectors(), message.has_bisectors(), field + ".bisectors");
  shape.opening_angles = decode_numbers(message.opening_angles());
  std::vector<Eigen::Vector2d> lengths;
  if (message.has_lengths()) lengths = decode_polygon(message.lengths(), field + ".lengths");
  shape.lengths.resize(2, static_cast<Eigen::Index>(lengths.size()));
  for (std::size_t i = 0; i < lengths.size(); ++i)
    shape.lengths.col(static_cast<Eigen::Index>(i)) = lengths[i];
  shape.vertices = rows_of(message.vertices(), message.has_vertices(), field + ".vertices");
  shape.directors = rows_of(message.directors(), message.has_directors(), field + ".directors");
  shape.twists = decode_numbers(message.twists());
  return shape;
}

}  // namespace limber::server
