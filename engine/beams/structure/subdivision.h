#pragma once

#include <utility>
#include <vector>

#include "engine/beams/model/beam_model.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {

/// Elements of a structure cut into equal parts. Parts of an element follow each other in the cut
/// model, from its start to its finish, elements in their order. Nodes between them come after all
/// nodes of the structure, and hinged ends are the same in the same order.
class Subdivision {
 public:
  /// @param parts  of each element, >= 1; cables are straight and stay whole
  /// @throws Error{kInvalidArgument, "parts"} for other numbers of elements, or parts below 1
  Subdivision(const BeamModel& model, std::vector<int> parts);
  /// All beams into the same number of parts.
  [[nodiscard]] static Subdivision even(const BeamModel& model, int parts);
  /// Twice as many parts of each beam.
  [[nodiscard]] Subdivision halved(const BeamModel& model) const;

  /// Per element of the structure.
  [[nodiscard]] const std::vector<int>& parts() const { return parts_; }
  [[nodiscard]] int parts_of(int element) const { return parts_[index(element)]; }
  /// Element of the cut model that an element begins with; its parts follow.
  [[nodiscard]] int first_part(int element) const { return first_part_[index(element)]; }
  /// Node of the cut model after so many parts of an element. @param after  0 to its parts
  [[nodiscard]] int node(int element, int after) const;
  /// The structure's node that is nearest along the element to a node of the cut model.
  [[nodiscard]] int nearest_node(int cut_node) const;
  /// The structure's element that an element of the cut model is a part of.
  [[nodiscard]] int element_of_part(int part) const;
  /// Nodes of the structure, and of the cut model.
  [[nodiscard]] int given_nodes() const { return nodes_; }
  [[nodiscard]] int node_count() const { return first_node_.back(); }
  /// Elements of the cut model.
  [[nodiscard]] int elements() const { return first_part_.back(); }
  /// Is nothing cut?
  [[nodiscard]] bool is_whole() const { return node_count() == given_nodes(); }

  friend bool operator==(const Subdivision& a, const Subdivision& b) {
    return a.parts_ == b.parts_;
  }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }

  std::vector<int> parts_;
  std::vector<int> first_part_;                 // per element, and the end
  std::vector<int> first_node_;                 // inner ones, per element, and the end
  std::vector<std::pair<int, int>> end_nodes_;  // per element: start, finish
  int nodes_ = 0;                               // of the structure
};

/// The model whose elements are parts of the model's. Sections are the same, and so is the rest
/// shape (a part of the rest length, the same curvature, axis 3 as the whole element has it). Loads
/// over elements are over their parts. If nothing is cut, it is the model itself.
[[nodiscard]] BeamModel cut_model(const BeamModel& model, const Subdivision& subdivision);

/// A state of a cut structure as one of another cut of the same structure. Common nodes are the
/// same; nodes in between are on the cubic that the ends of the part around them give.
/// @param from  the structure of `state`, cut as `from_subdivision` says
[[nodiscard]] BeamState carry_state(const BeamStructure& from, const Subdivision& from_subdivision,
                                    const BeamState& state, const Subdivision& to);

/// The same without nodes between parts.
[[nodiscard]] BeamState without_parts(const BeamState& state, int nodes);

}  // namespace limber::beams
