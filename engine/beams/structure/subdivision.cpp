#include "engine/beams/structure/subdivision.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/index.h"
#include "engine/base/rotations/shortest_rotation.h"

namespace limber::beams {
namespace {

/// A point of an element, and how its section has turned from rest.
struct Place {
  Eigen::Vector3d position;
  Eigen::Quaterniond rotation;
};

/// The cubic between two ends, of the arc length that bowing says.
Place place_within(const BeamStructure& structure, const BeamState& state, int element, double s) {
  const ElementEnds ends = structure.ends(state, element);
  const Triad<double> a = triad(ends.start_axes), b = triad(ends.finish_axes);
  const ElementConstants<double>& k = structure.constants(element);
  const NaturalModes<double> modes(k, vec(ends.finish - ends.start), a, b);
  const double length = std::max(modes.chord, k.length + modes.stretch);
  const Eigen::Vector3d from = length * ends.start_axes.col(0),
                        to = length * ends.finish_axes.col(0);
  const double s2 = s * s, s3 = s2 * s;
  Place place;
  place.position = (1 - 3 * s2 + 2 * s3) * ends.start + (3 * s2 - 2 * s3) * ends.finish +
                   (s - 2 * s2 + s3) * from + (s3 - s2) * to;
  const Eigen::Vector3d tangent = 6 * (s - s2) * (ends.finish - ends.start) +
                                  (1 - 4 * s + 3 * s2) * from + (3 * s2 - 2 * s) * to;
  const Eigen::Quaterniond between =
      structure.end_rotation(state, element, ElementEnd::kStart)
          .slerp(s, structure.end_rotation(state, element, ElementEnd::kFinish));
  const Eigen::Vector3d along = between * structure.rest_axes(element).col(0);
  place.rotation = (rotations::shortest_rotation(along, tangent) * between).normalized();
  return place;
}

}  // namespace

Subdivision::Subdivision(const BeamModel& model, std::vector<int> parts)
    : parts_(std::move(parts)), nodes_(static_cast<int>(model.nodes.size())) {
  if (parts_.size() != model.elements.size())
    throw Error(
        ErrorCode::kInvalidArgument, "parts",
        fmt::format("{} numbers of parts for {} elements", parts_.size(), model.elements.size()));
  int part = 0, node = nodes_;
  for (std::size_t e = 0; e < parts_.size(); ++e) {
    if (parts_[e] < 1)
      throw Error(ErrorCode::kInvalidArgument, "parts",
                  fmt::format("parts[{}] = {}, must be >= 1", e, parts_[e]));
    if (model.elements[e].kind == BeamKind::kCable) parts_[e] = 1;
    first_part_.push_back(part);
    first_node_.push_back(node);
    end_nodes_.emplace_back(model.elements[e].start, model.elements[e].finish);
    part += parts_[e];
    node += parts_[e] - 1;
  }
  first_part_.push_back(part);
  first_node_.push_back(node);
}

Subdivision Subdivision::even(const BeamModel& model, int parts) {
  return {model, std::vector<int>(model.elements.size(), parts)};
}

Subdivision Subdivision::halved(const BeamModel& model) const {
  std::vector<int> parts = parts_;
  for (int& count : parts) count *= 2;
  return {model, std::move(parts)};
}

int Subdivision::node(int element, int after) const {
  const auto& [start, finish] = end_nodes_[index(element)];
  if (after == 0) return start;
  return after == parts_of(element) ? finish : first_node_[index(element)] + after - 1;
}

int Subdivision::nearest_node(int cut_node) const {
  if (cut_node < nodes_) return cut_node;
  const auto after = std::upper_bound(first_node_.begin(), first_node_.end(), cut_node);
  const auto element = static_cast<int>(after - first_node_.begin()) - 1;
  const int steps = cut_node - first_node_[index(element)] + 1;
  return 2 * steps <= parts_of(element) ? node(element, 0) : node(element, parts_of(element));
}

int Subdivision::element_of_part(int part) const {
  const auto after = std::upper_bound(first_part_.begin(), first_part_.end(), part);
  return static_cast<int>(after - first_part_.begin()) - 1;
}

BeamModel cut_model(const BeamModel& model, const Subdivision& subdivision) {
  if (subdivision.is_whole()) return model;
  BeamModel result = model;
  result.elements.clear();
  for (int e = 0; e < static_cast<int>(model.elements.size()); ++e) {
    const BeamElement& element = model.elements[index(e)];
    const int parts = subdivision.parts_of(e);
    const BeamNode &a = model.nodes[index(element.start)], &b = model.nodes[index(element.finish)];
    for (int i = 0; i < parts; ++i) {
      BeamElement part = element;
      part.start = subdivision.node(e, i);
      part.finish = subdivision.node(e, i + 1);
      if (parts > 1) part.normal = drawn_normal(model, e);
      part.rest_length = element.rest_length / parts;
      if (i > 0) part.start_release = {};
      if (i + 1 < parts) {
        part.finish_release = {};
        const double share = static_cast<double>(i + 1) / parts;
        result.nodes.push_back({(1 - share) * a.position + share * b.position, a.normal});
      }
      result.elements.push_back(part);
      result.element_parts.push_back({e, i, parts});
    }
  }
  result.distributed_loads.clear();
  for (const DistributedLoad& load : model.distributed_loads) {
    DistributedLoad of_part = load;
    for (int i = 0; i < subdivision.parts_of(load.element); ++i) {
      of_part.element = subdivision.first_part(load.element) + i;
      result.distributed_loads.push_back(of_part);
    }
  }
  return result;
}

BeamState carry_state(const BeamStructure& from, const Subdivision& from_subdivision,
                      const BeamState& state, const Subdivision& to) {
  const int nodes = to.node_count();
  BeamState result;
  result.positions.resize(3, nodes);
  result.rotations.resize(index(nodes));
  result.hinge_turns = state.hinge_turns;
  const int common = to.given_nodes();
  result.positions.leftCols(common) = state.positions.leftCols(common);
  std::copy_n(state.rotations.begin(), common, result.rotations.begin());
  for (int e = 0; e < static_cast<int>(to.parts().size()); ++e) {
    const int parts = to.parts_of(e), before = from_subdivision.parts_of(e);
    for (int i = 1; i < parts; ++i) {
      const int node = to.node(e, i);
      const int steps = i * before / parts, rest = i * before % parts;
      if (rest == 0) {
        const int same = from_subdivision.node(e, steps);
        result.positions.col(node) = state.positions.col(same);
        result.rotations[index(node)] = state.rotations[index(same)];
        continue;
      }
      const Place place = place_within(from, state, from_subdivision.first_part(e) + steps,
                                       static_cast<double>(rest) / parts);
      result.positions.col(node) = place.position;
      result.rotations[index(node)] = place.rotation;
    }
  }
  return result;
}

BeamState without_parts(const BeamState& state, int nodes) {
  return {state.positions.leftCols(nodes),
          {state.rotations.begin(), state.rotations.begin() + nodes},
          state.hinge_turns};
}

}  // namespace limber::beams
