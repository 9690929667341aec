#pragma once

#include <Eigen/Core>

#include "engine/beams/element/spread_load.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {

/// All loads of a model: columns are nodes, and elements. Those on nodes are of fixed direction, or
/// as at rest, and turn with the node. Loads over elements, with weights, are their resultants
/// [force], spread evenly over the length at rest.
struct NodeLoads {
  Eigen::Matrix3Xd forces, moments;
  Eigen::Matrix3Xd following_forces, following_moments;
  Eigen::Matrix3Xd element_forces;            // of fixed direction
  Eigen::Matrix3Xd following_element_forces;  // as at rest; turn with the ends of the element

  /// Loads, distributed loads and weights of a model.
  [[nodiscard]] static NodeLoads of(const BeamModel& model);
  /// None, of a model's size.
  [[nodiscard]] static NodeLoads none(const BeamModel& model);
  /// Its temporary loads.
  [[nodiscard]] static NodeLoads temporary(const BeamModel& model);

  [[nodiscard]] bool empty() const;
  [[nodiscard]] bool follows() const;         // any following force or moment
  [[nodiscard]] bool loads_elements() const;  // any load over an element
  [[nodiscard]] NodeLoads operator*(double factor) const;
  [[nodiscard]] NodeLoads operator+(const NodeLoads& other) const;
};

/// Forces and moments on the unknowns of a structure, in its order. Loads over elements act by
/// spread_forces, also on released angles.
[[nodiscard]] Eigen::VectorXd load_vector(const BeamStructure& structure, const NodeLoads& loads,
                                          const BeamState& state);

/// How loads over an element reach its ends.
[[nodiscard]] LoadTransfer load_transfer(const BeamStructure& structure, int element);

/// Loads over an element that follow, as they have turned with its ends; of a cable, which has no
/// rotations, with its chord.
[[nodiscard]] SpreadLoad following_load(const BeamStructure& structure, const NodeLoads& loads,
                                        const ElementEnds& ends, int element);
/// All loads over an element.
[[nodiscard]] SpreadLoad load_over(const BeamStructure& structure, const NodeLoads& loads,
                                   const ElementEnds& ends, int element);

}  // namespace limber::beams
