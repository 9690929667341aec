#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/session/beams/analysis.h"

namespace limber::session::detail {

/// A column of a table: how it is called, its unit (SI), and a number per row.
struct BeamColumn {
  const char* name;
  const char* unit;
  Eigen::VectorXd values;
};

/// Nodes: position, rotation vector, reactions.
[[nodiscard]] std::vector<BeamColumn> node_columns(const BeamAnalysis& analysis);
/// Elements: forces, moments, stresses, energy. What is not known is not a number.
[[nodiscard]] std::vector<BeamColumn> element_columns(const BeamAnalysis& analysis);

/// Rotation vectors from rest, 3 x nodes [rad], of length at most pi.
[[nodiscard]] Eigen::Matrix3Xd rotation_vectors(const beams::BeamState& state);

}  // namespace limber::session::detail
