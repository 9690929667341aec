#include "clients/cpp/linkages/shapes.h"

#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include "clients/cpp/array_numbers.h"
#include "engine/base/checked_number.h"

namespace limber::client {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

ClientError malformed_shape(const std::string& message) {
  return {v1::ERROR_CODE_MALFORMED, "", message};
}

std::vector<Point> take_points(const double*& from, int count) {
  std::vector<Point> points(static_cast<std::size_t>(count));
  for (Point& point : points)
    for (double& number : point) number = *from++;
  return points;
}

Point middle(const Point& a, const Point& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

}  // namespace

LinkageGeometry::LinkageGeometry(const v1::GetGeometryResponse& message) {
  if (!message.has_linkage())
    throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "session", "this is no rod linkage");
  const v1::LinkageGeometry& given = message.linkage();
  const auto ends = numbers<std::int32_t>(given.joints_of_segment(), v1::DATA_TYPE_INT32, 2,
                                          "joints of segments");
  const auto segments = static_cast<std::size_t>(given.edges_size());
  if (given.joints_of_segment().shape(1) != 2 || ends.size() != 2 * segments)
    throw malformed_shape("joints of segments are not two a segment");
  for (const auto vertex : given.vertex_of_joint()) {
    const auto number = to_whole<int>(vertex);
    if (!number) throw malformed_shape("a joint is at no vertex");
    vertex_of_joint_.push_back(*number);
  }
  hash_ = message.basis_hash();
  coordinates_ = vertex_of_joint_.size();
  for (std::size_t s = 0; s < segments; ++s) {
    const auto edges = to_whole<int>(given.edges(static_cast<int>(s)));
    if (!edges || *edges < 1) throw malformed_shape("a segment has no edges");
    edges_.push_back(*edges);
    coordinates_ += 6 * static_cast<std::size_t>(*edges) + 3;
    ends_.push_back({ends[2 * s], ends[2 * s + 1]});
    for (const int joint : ends_.back())
      if (joint < -1 || joint >= joints()) throw malformed_shape("a segment ends at no joint");
  }
  if (coordinates_ != given.coordinates())
    throw malformed_shape("a shape is not the sum of its parts");
  mixed_angles_ = given.mixed_angles();
  for (const v1::LinkageRod& rod : given.rods()) {
    if (rod.segments_size() != rod.reversed_size()) throw malformed_shape("a rod is incomplete");
    LinkageRod made;
    for (const auto segment : rod.segments()) {
      const auto number = to_whole<int>(segment);
      if (!number || segment >= segments)
        throw malformed_shape("a rod has a segment that is not there");
      made.segments.push_back(*number);
    }
    made.reversed.assign(rod.reversed().begin(), rod.reversed().end());
    made.closed = rod.closed();
    rods_.push_back(std::move(made));
  }
}

std::vector<LinkageShape> LinkageGeometry::shapes(const v1::Frames& frames) const {
  if (frames.encoding() != v1::ENCODING_COORDINATES)
    throw malformed_shape("shapes are made of coordinates, not of positions");
  const auto rows = real_numbers(frames.data(), 2, "coordinates");
  if (frames.data().shape(1) != coordinates_)
    throw malformed_shape("coordinates of another linkage");
  std::vector<LinkageShape> shapes;
  for (std::size_t at = 0; at < rows.size(); at += coordinates_)
    shapes.push_back(shape(rows.data() + at));
  return shapes;
}

LinkageShape LinkageGeometry::shape(const double* numbers) const {
  LinkageShape shape;
  shape.joints.resize(vertex_of_joint_.size());
  for (Point& joint : shape.joints) joint.fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t s = 0; s < edges_.size(); ++s) {
    shape.centrelines.push_back(take_points(numbers, edges_[s] + 1));
    shape.directors.push_back(take_points(numbers, edges_[s]));
    const auto& line = shape.centrelines.back();
    const auto [start, finish] = ends_[s];
    if (start >= 0) shape.joints[static_cast<std::size_t>(start)] = middle(line[0], line[1]);
    if (finish >= 0) {
      shape.joints[static_cast<std::size_t>(finish)] =
          middle(line[line.size() - 2], line[line.size() - 1]);
    }
  }
  for (std::size_t j = 0; j < shape.joints.size(); ++j)
    shape.angles.push_back(*numbers++ / kDegree);
  return shape;
}

}  // namespace limber::client
