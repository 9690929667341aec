#pragma once

#include <Eigen/Core>

#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {

/// All loads of a model, per node: columns are nodes. Distributed loads and weights go by halves to
/// the nodes of their element.
struct NodeLoads {
  Eigen::Matrix3Xd forces, moments;                      // fixed directions
  Eigen::Matrix3Xd following_forces, following_moments;  // as at rest; turn with the node

  /// Loads, distributed loads and weights of a model.
  [[nodiscard]] static NodeLoads of(const BeamModel& model);
  /// Its temporary loads.
  [[nodiscard]] static NodeLoads temporary(const BeamModel& model);

  [[nodiscard]] bool empty() const;
  [[nodiscard]] bool follows() const;  // any following force or moment
  [[nodiscard]] NodeLoads operator*(double factor) const;
  [[nodiscard]] NodeLoads operator+(const NodeLoads& other) const;
};

/// Forces and moments on the unknowns of a structure, in its order; released angles get none.
[[nodiscard]] Eigen::VectorXd load_vector(const BeamStructure& structure, const NodeLoads& loads,
                                          const BeamState& state);

}  // namespace limber::beams
