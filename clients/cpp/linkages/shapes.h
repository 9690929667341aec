#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"

namespace limber::client {

using Point = std::array<double, 3>;  // x y z [length unit]

/// One shape of a rod linkage. The first and the last edge of a segment reach half their length
/// beyond its joints.
struct LinkageShape {
  std::vector<std::vector<Point>> centrelines;  // of each segment, edges + 1
  std::vector<std::vector<Point>> directors;    // of each segment, d1 of its edges, unit
  std::vector<double> angles;                   // opening angle of each joint [degree]
  std::vector<Point> joints;                    // NaN where a joint has no segment
};

/// Segments that go on in each other at joints.
struct LinkageRod {
  std::vector<int> segments;   // in order along the rod
  std::vector<bool> reversed;  // of each: it runs from its finish to its start
  bool closed = false;         // a ring: the last segment goes on in the first
};

/// Data common to all shapes of a linkage.
class LinkageGeometry {
 public:
  /// @throws ClientError FAILED_PRECONDITION for the geometry of a body, MALFORMED for parts that
  /// do not fit each other
  explicit LinkageGeometry(const v1::GetGeometryResponse& message);

  /// The shapes of frames in ENCODING_COORDINATES, in their order.
  /// @throws ClientError MALFORMED for frames of another linkage or encoding
  [[nodiscard]] std::vector<LinkageShape> shapes(const v1::Frames& frames) const;

  /// Hash of the edges: frames refer to their edges by basis_hash.
  [[nodiscard]] const std::string& hash() const { return hash_; }
  [[nodiscard]] int segments() const { return static_cast<int>(edges_.size()); }
  [[nodiscard]] int joints() const { return static_cast<int>(vertex_of_joint_.size()); }
  [[nodiscard]] const std::vector<int>& edges() const { return edges_; }  // of each segment
  /// For each segment, from its start to its finish; -1: a free end.
  [[nodiscard]] const std::vector<std::array<int, 2>>& joints_of_segment() const { return ends_; }
  /// For each joint, the vertex of the line mesh.
  [[nodiscard]] const std::vector<int>& vertex_of_joint() const { return vertex_of_joint_; }
  /// Every segment is in one of them.
  [[nodiscard]] const std::vector<LinkageRod>& rods() const { return rods_; }
  /// A rotation that opens one joint closes the next: there is no mean opening angle to request.
  [[nodiscard]] bool mixed_angles() const { return mixed_angles_; }

 private:
  [[nodiscard]] LinkageShape shape(const double* numbers) const;

  std::string hash_;
  std::vector<int> edges_;
  std::vector<std::array<int, 2>> ends_;
  std::vector<int> vertex_of_joint_;
  std::vector<LinkageRod> rods_;
  bool mixed_angles_ = false;
  std::size_t coordinates_ = 0;  // numbers of one shape
};

}  // namespace limber::client
