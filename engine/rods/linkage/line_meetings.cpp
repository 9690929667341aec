#include "engine/rods/linkage/line_meetings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

namespace limber::rods {
namespace {

constexpr double kMeetingDistance = 1e-3;  // of the shorter edge
constexpr double kParallel = 0.1;          // sine below which edges lie side by side
constexpr int kLeaf = 8;                   // edges
// Pairs that are checked, for each edge, and meetings after which the search ends.
constexpr std::int64_t kPairsOfEdge = 300;
constexpr std::size_t kMaxFound = 1000;

using Box = Eigen::AlignedBox3d;

/// Boxes around halves of halves of the edges.
class EdgeTree {
 public:
  explicit EdgeTree(const std::vector<Box>& boxes) : boxes_(boxes), order_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.reserve(2 * boxes.size() / kLeaf + 2);
    build(0, static_cast<int>(boxes.size()));
  }

  /// Calls visit(edge) for edges whose boxes touch this one, until that is false.
  template <class Visit>
  bool each(const Box& box, const Visit& visit) const {
    return each_of(0, box, visit);
  }

 private:
  struct Node {
    Box box;
    int first = 0, last = 0;
    int right = -1;  // the left one follows its parent; -1: a leaf
  };

  int build(int first, int last) {
    const int at = static_cast<int>(nodes_.size());
    nodes_.push_back({Box(), first, last, -1});
    Box box, middles;
    for (int i = first; i < last; ++i) {
      const Box& edge = boxes_[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
      box.extend(edge);
      middles.extend(edge.center());
    }
    nodes_[static_cast<std::size_t>(at)].box = box;
    if (last - first <= kLeaf) return at;
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    const int middle = first + (last - first) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](int a, int b) {
                       return boxes_[static_cast<std::size_t>(a)].center()[axis] <
                              boxes_[static_cast<std::size_t>(b)].center()[axis];
                     });
    build(first, middle);
    const int right = build(middle, last);
    nodes_[static_cast<std::size_t>(at)].right = right;
    return at;
  }

  template <class Visit>
  bool each_of(int at, const Box& box, const Visit& visit) const {
    const Node& node = nodes_[static_cast<std::size_t>(at)];
    if (!node.box.intersects(box)) return true;
    if (node.right >= 0) return each_of(at + 1, box, visit) && each_of(node.right, box, visit);
    for (int i = node.first; i < node.last; ++i) {
      const int edge = order_[static_cast<std::size_t>(i)];
      if (boxes_[static_cast<std::size_t>(edge)].intersects(box) && !visit(edge)) return false;
    }
    return true;
  }

  const std::vector<Box>& boxes_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

struct Line {
  Eigen::Vector3d start, direction;
  double length;
};

/// Shares of two lines, in [0, 1], at which they are nearest (Ericson, Real-Time Collision
/// Detection, 5.1.9).
Eigen::Vector2d nearest_shares(const Line& one, const Line& other) {
  const auto clamped = [](double share) { return std::clamp(share, 0.0, 1.0); };
  const Eigen::Vector3d between = one.start - other.start;
  const double a = one.direction.squaredNorm(), e = other.direction.squaredNorm();
  const double b = one.direction.dot(other.direction), c = one.direction.dot(between),
               f = other.direction.dot(between);
  const double denominator = a * e - b * b;
  double s = denominator > 0 ? clamped((b * f - c * e) / denominator) : 0;
  double t = (b * s + f) / e;
  if (t < 0 || t > 1) {
    t = clamped(t);
    s = clamped((b * t - c) / a);
  }
  return {s, t};
}

class Search {
 public:
  Search(const LineMesh& mesh, int most)
      : mesh_(mesh),
        most_(static_cast<std::size_t>(most)),
        valence_(static_cast<std::size_t>(mesh.vertex_count()), 0) {
    lines_.reserve(static_cast<std::size_t>(mesh.edge_count()));
    for (int e = 0; e < mesh.edge_count(); ++e) {
      const Eigen::Vector3d start = mesh.vertices.col(mesh.edges(0, e));
      const Eigen::Vector3d direction = mesh.vertices.col(mesh.edges(1, e)) - start;
      lines_.push_back({start, direction, direction.norm()});
      shortest_ = std::min(shortest_, lines_.back().length);
      for (int end = 0; end < 2; ++end) ++valence_[static_cast<std::size_t>(mesh.edges(end, e))];
    }
  }

  LineMeetings run() {
    std::vector<Box> boxes;
    boxes.reserve(lines_.size());
    for (const Line& line : lines_) {
      const Eigen::Vector3d margin = Eigen::Vector3d::Constant(near(line.length) / 2);
      Box box(line.start);
      box.extend(Eigen::Vector3d(line.start + line.direction));
      boxes.emplace_back(box.min() - margin, box.max() + margin);
    }
    const EdgeTree tree(boxes);
    std::int64_t left = kPairsOfEdge * static_cast<std::int64_t>(lines_.size());
    LineMeetings found;
    for (int e = 0; e < mesh_.edge_count() && found.all; ++e) {
      found.all = tree.each(boxes[static_cast<std::size_t>(e)], [&](int other) {
        if (left-- <= 0) return false;
        return other <= e || look_at(e, other);
      });
    }
    found.count = static_cast<int>(found_meetings_.size());
    std::sort(meetings_.begin(), meetings_.end(), [](const auto& a, const auto& b) {
      return std::pair(a.edges[0], a.edges[1]) < std::pair(b.edges[0], b.edges[1]);
    });
    if (meetings_.size() > most_) meetings_.resize(most_);
    found.listed = std::move(meetings_);
    return found;
  }

 private:
  [[nodiscard]] double near(double length) const {
    return std::min(kMeetingDistance * length, shortest_ / 2);
  }

  /// False: they meet where that was not known, and the search ends.
  bool look_at(int e, int other) {
    const auto ends = mesh_.edges.col(e), others = mesh_.edges.col(other);
    for (int end = 0; end < 2; ++end)
      if (ends[end] == others[0] || ends[end] == others[1]) return true;
    const Line& one = lines_[static_cast<std::size_t>(e)];
    const Line& two = lines_[static_cast<std::size_t>(other)];
    const double tolerance = near(std::min(one.length, two.length));
    Eigen::Vector2d shares = nearest_shares(one, two);
    const Eigen::Vector3d place = one.start + shares[0] * one.direction;
    if ((place - two.start - shares[1] * two.direction).norm() > tolerance) return true;
    LineMeeting meeting;
    meeting.edges = {e, other};
    meeting.place = place;
    meeting.vertices = {vertex_at(e, shares[0], tolerance), vertex_at(other, shares[1], tolerance)};
    const bool aside =
        one.direction.cross(two.direction).norm() < kParallel * one.length * two.length;
    if (aside && !continues(meeting)) return true;
    return note(meeting);
  }

  [[nodiscard]] int vertex_at(int edge, double share, double tolerance) const {
    const double length = lines_[static_cast<std::size_t>(edge)].length;
    if (share * length <= tolerance) return mesh_.edges(0, edge);
    return (1 - share) * length <= tolerance ? mesh_.edges(1, edge) : -1;
  }

  /// Loose ends that point at each other.
  [[nodiscard]] bool continues(const LineMeeting& meeting) const {
    Eigen::Vector3d out[2];
    for (int i = 0; i < 2; ++i) {
      const int vertex = meeting.vertices[i];
      if (vertex < 0 || valence_[static_cast<std::size_t>(vertex)] > 1) return false;
      const Eigen::Vector3d& direction =
          lines_[static_cast<std::size_t>(meeting.edges[i])].direction;
      out[i] = mesh_.edges(0, meeting.edges[i]) == vertex ? Eigen::Vector3d(-direction) : direction;
    }
    return out[0].dot(out[1]) < 0;
  }

  /// Once for each place, though several edges meet there.
  bool note(LineMeeting& meeting) {
    const Eigen::Vector2i& vertices = meeting.vertices;
    std::tuple<int, int, int> key;
    if (vertices[0] >= 0 && vertices[1] >= 0) {
      meeting.kind = LineMeeting::Kind::kVertices;
      key = {0, vertices.minCoeff(), vertices.maxCoeff()};
    } else if (vertices[0] >= 0 || vertices[1] >= 0) {
      meeting.kind = LineMeeting::Kind::kVertexEdge;
      key = {1, vertices.maxCoeff(), vertices[0] >= 0 ? meeting.edges[1] : meeting.edges[0]};
    } else {
      key = {2, meeting.edges[0], meeting.edges[1]};
    }
    if (found_meetings_.count(key) > 0) return true;
    if (found_meetings_.size() == kMaxFound) return false;
    found_meetings_.insert(key);
    meetings_.push_back(meeting);
    return true;
  }

  const LineMesh& mesh_;
  const std::size_t most_;
  std::vector<Line> lines_;
  std::vector<int> valence_;  // of vertices
  double shortest_ = std::numeric_limits<double>::infinity();
  std::set<std::tuple<int, int, int>> found_meetings_;
  std::vector<LineMeeting> meetings_;
};

}  // namespace

LineMeetings find_line_meetings(const LineMesh& mesh, int most) {
  if (mesh.edge_count() == 0) return {};
  return Search(mesh, most).run();
}

}  // namespace limber::rods
