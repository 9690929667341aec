#include "engine/rods/linkage/halved_linkage.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/rods/linkage/state_check.h"
#include "engine/rods/linkage/state_numbers.h"

namespace limber::rods {
namespace {

bool has_joint(const LinkageGraph& graph, int segment, End end) {
  return graph.segments[static_cast<std::size_t>(segment)].joints[end] >= 0;
}

/// Places of the halved vertices of a segment of so many given edges. Terminal edges reach a
/// quarter of a given edge to both sides of their joints; free edges share the length between.
std::vector<double> places_of(const LinkageGraph& graph, int segment, int given, int halved) {
  const bool start = has_joint(graph, segment, kStart), finish = has_joint(graph, segment, kFinish);
  std::vector<double> places;
  const double from = start ? 0.75 : 0, to = finish ? given - 0.75 : given;
  const int edges = halved - (start ? 1 : 0) - (finish ? 1 : 0);
  if (start) places.push_back(0.25);
  for (int k = 0; k <= edges; ++k) places.push_back(from + (to - from) * k / edges);
  if (finish) places.push_back(given - 0.25);
  return places;
}

std::vector<std::vector<double>> places_of(const LinkageGraph& graph,
                                           const ReducedVariables& variables,
                                           const ReducedVariables& halved) {
  std::vector<std::vector<double>> places;
  places.reserve(static_cast<std::size_t>(variables.segments()));
  for (int s = 0; s < variables.segments(); ++s)
    places.push_back(places_of(graph, s, variables.edges(s), halved.edges(s)));
  return places;
}

/// Between the values at whole places.
double value_at(const Eigen::VectorXd& values, double place) {
  const auto edge =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(place), 0, values.size() - 2);
  return values[edge] + (place - static_cast<double>(edge)) * (values[edge + 1] - values[edge]);
}
/// Place at which ascending values reach this one.
double place_of(const Eigen::VectorXd& values, double value) {
  const auto after = std::upper_bound(values.begin(), values.end(), value) - values.begin();
  const auto edge = std::clamp<Eigen::Index>(after - 1, 0, values.size() - 2);
  const double share = (value - values[edge]) / (values[edge + 1] - values[edge]);
  return std::clamp(static_cast<double>(edge) + share, 0.0, static_cast<double>(values.size() - 1));
}

/// At rest, from a segment's first vertex to each.
Eigen::VectorXd lengths_of(const LinkageModel& model, int segment) {
  const int edges = model.variables().edges(segment);
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(edges + 1);
  for (int e = 0; e < edges; ++e) {
    lengths[e + 1] =
        lengths[e] + model.rest_lengths().edge(model.graph(), model.variables(), segment, e);
  }
  return lengths;
}

/// A segment as a curve over its material: vertices by arc length at rest.
class Curve {
 public:
  Curve(const LinkageModel& model, const LinkageState& state, int segment)
      : edges_(model.variables().edges(segment)),
        points_(3, edges_ + 1),
        lengths_(lengths_of(model, segment)) {
    for (int i = 0; i <= edges_; ++i) points_.col(i) = state.vertex(model, segment, i);
  }

  [[nodiscard]] int edges() const { return edges_; }
  [[nodiscard]] Eigen::Vector3d tangent(int edge) const {
    return (points_.col(edge + 1) - points_.col(edge)).normalized();
  }
  [[nodiscard]] double length_at(double place) const { return value_at(lengths_, place); }
  [[nodiscard]] double middle(int edge) const {
    return 0.5 * (lengths_[edge] + lengths_[edge + 1]);
  }

  /// On the straight edge there.
  [[nodiscard]] Eigen::Vector3d on_edge(double place) const {
    const int edge = std::clamp(static_cast<int>(place), 0, edges_ - 1);
    return points_.col(edge) + (place - edge) * (points_.col(edge + 1) - points_.col(edge));
  }
  /// By the cubic through the four vertices next to it; fewer where there are fewer.
  [[nodiscard]] Eigen::Vector3d at(double place) const {
    const int count = std::min(4, edges_ + 1);
    const int first = std::clamp(static_cast<int>(place) - 1, 0, edges_ + 1 - count);
    const double s = length_at(place);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = first; i < first + count; ++i) {
      double weight = 1;
      for (int k = first; k < first + count; ++k)
        if (k != i) weight *= (s - lengths_[k]) / (lengths_[i] - lengths_[k]);
      sum += weight * points_.col(i);
    }
    return sum;
  }

 private:
  int edges_;
  Eigen::Matrix3Xd points_;
  Eigen::VectorXd lengths_;  // at rest, up to each vertex
};

/// Material frames along a segment: between those of two edges turned by a share of their twist.
class Frames {
 public:
  Frames(const LinkageModel& model, const LinkageState& state, int segment, const Curve& curve)
      : curve_(curve), turns_(curve.edges()), directors_(3, curve.edges()) {
    for (int e = 0; e < curve.edges(); ++e) {
      directors_.col(e) = state.director(model, segment, e);
      turns_[e] = e == 0 ? 0 : turns_[e - 1] + state.twist(model, segment, e);
    }
  }

  /// Sum of the twists up to there.
  [[nodiscard]] double turn(double length) const {
    const int edge = edge_before(length);
    return turns_[edge] + share(edge, length) * twist(edge);
  }
  /// d_1 of an edge whose middle is there.
  [[nodiscard]] Eigen::Vector3d director(double length, const Eigen::Vector3d& tangent) const {
    const int edge = edge_before(length);
    const Eigen::Vector3d carried =
        rotations::shortest_rotation(curve_.tangent(edge), tangent) * directors_.col(edge);
    return Eigen::AngleAxisd(share(edge, length) * twist(edge), tangent) * carried;
  }

 private:
  /// The last one whose middle lies before, but for the ends.
  [[nodiscard]] int edge_before(double length) const {
    int edge = 0;
    while (edge + 2 < curve_.edges() && curve_.middle(edge + 1) <= length) ++edge;
    return edge;
  }
  [[nodiscard]] double share(int edge, double length) const {
    if (edge + 1 >= curve_.edges()) return 0;
    const double from = curve_.middle(edge);
    return std::clamp((length - from) / (curve_.middle(edge + 1) - from), 0.0, 1.0);
  }
  [[nodiscard]] double twist(int edge) const {
    return edge + 1 < curve_.edges() ? turns_[edge + 1] - turns_[edge] : 0;
  }

  const Curve& curve_;
  Eigen::VectorXd turns_;
  Eigen::Matrix3Xd directors_;
};

}  // namespace

std::vector<int> halved_edges(const LinkageGraph& graph, const ReducedVariables& variables) {
  std::vector<int> edges;
  for (int s = 0; s < variables.segments(); ++s) {
    const bool between = has_joint(graph, s, kStart) && has_joint(graph, s, kFinish);
    edges.push_back(2 * variables.edges(s) - (between ? 1 : 0));
  }
  return edges;
}

HalvedLinkage::HalvedLinkage(const LinkageModel& model)
    : halved_(model.graph(), halved_edges(model.graph(), model.variables()), model.stiffness(),
              model.form()),
      places_(places_of(model.graph(), model.variables(), halved_.variables())) {
  set_sizes(model);
}

void HalvedLinkage::set_sizes(const LinkageModel& given) {
  LIMBER_DEMAND(std::ssize(places_) == given.variables().segments());
  const EdgeNumbers& numbers = halved_.edge_numbers();
  Eigen::VectorXd edges(numbers.size());
  given_lengths_.clear();
  halved_lengths_.clear();
  for (int s = 0; s < given.variables().segments(); ++s) {
    const auto& places = places_[static_cast<std::size_t>(s)];
    given_lengths_.push_back(lengths_of(given, s));
    Eigen::VectorXd& lengths = halved_lengths_.emplace_back(std::ssize(places));
    for (Eigen::Index i = 0; i < lengths.size(); ++i)
      lengths[i] = value_at(given_lengths_.back(), places[static_cast<std::size_t>(i)]);
    for (int e = 0; e + 1 < static_cast<int>(places.size()); ++e)
      edges[numbers.edge(s, e)] = lengths[e + 1] - lengths[e];
  }
  halved_.set_edge_lengths(edges);
  halved_.set_section_scales(given.section_scales());
}

LinkageState HalvedLinkage::prolonged(const LinkageModel& given, const LinkageState& state) const {
  const ReducedVariables& variables = halved_.variables();
  StateNumbers numbers = state.numbers(given);
  numbers.lengths *= 0.5;
  const StateSizes counts = state_sizes(variables);
  numbers.vertices.resize(3, counts.vertices);
  numbers.directors.resize(3, counts.directors);
  numbers.twists.resize(counts.twists);
  Eigen::Index vertex = 0, director = 0, twist = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    const auto& places = places_[static_cast<std::size_t>(s)];
    const Curve curve(given, state, s);
    const Frames frames(given, state, s, curve);
    const int edges = variables.edges(s);
    Eigen::Matrix3Xd points(3, edges + 1);
    for (int i = 0; i <= edges; ++i) {  // a joint places the ends of its edge
      const bool of_joint = variables.position(s, i) < 0;
      const double place = places[static_cast<std::size_t>(i)];
      points.col(i) = of_joint ? curve.on_edge(place) : curve.at(place);
    }
    const auto middle = [&](int edge) {
      return 0.5 * (curve.length_at(places[static_cast<std::size_t>(edge)]) +
                    curve.length_at(places[static_cast<std::size_t>(edge) + 1]));
    };
    for (int i = 0; i <= edges; ++i)
      if (variables.position(s, i) >= 0) numbers.vertices.col(vertex++) = points.col(i);
    for (int e = 0; e < edges; ++e) {
      if (variables.angle(s, e) < 0) continue;
      const Eigen::Vector3d tangent = (points.col(e + 1) - points.col(e)).normalized();
      numbers.directors.col(director++) = frames.director(middle(e), tangent);
    }
    for (int i = 1; i < edges; ++i)
      numbers.twists[twist++] = frames.turn(middle(i)) - frames.turn(middle(i - 1));
  }
  return {halved_, numbers};
}

double HalvedLinkage::halved_place(int segment, double place) const {
  const auto s = static_cast<std::size_t>(segment);
  return place_of(halved_lengths_[s], value_at(given_lengths_[s], place));
}

HalvedLinkage::Distance HalvedLinkage::distance(const LinkageModel& given,
                                                const LinkageState& given_state,
                                                const LinkageState& halved_state) const {
  Distance result;
  const auto note = [&](double distance, int segment, double place) {
    if (distance > result.largest) result = {distance, segment, place};
  };
  for (int s = 0; s < given.variables().segments(); ++s) {
    const int edges = given.variables().edges(s);
    const Segment& segment = given.graph().segments[static_cast<std::size_t>(s)];
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] < 0) continue;
      const auto joint = static_cast<std::size_t>(segment.joints[end]);
      note((given_state.joints()[joint].position - halved_state.joints()[joint].position).norm(), s,
           end == kStart ? 0.5 : edges - 0.5);
    }
    const Curve curve(halved_, halved_state, s);
    const int first = segment.joints[kStart] >= 0 ? 1 : 0;
    const int last = segment.joints[kFinish] >= 0 ? edges - 1 : edges;
    for (int i = first; i <= last; ++i) {
      note((given_state.vertex(given, s, i) - curve.at(halved_place(s, i))).norm(), s, i);
    }
  }
  return result;
}

}  // namespace limber::rods
