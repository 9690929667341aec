#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "engine/session/beams/analysis.h"

namespace limber::session::detail {

/// A column of a table: how it is called, its unit (SI), and a number per row.
struct BeamColumn {
  std::string name;
  const char* unit;
  Eigen::VectorXd values;
};

/// Nodes: position, rotation vector, reactions.
[[nodiscard]] std::vector<BeamColumn> node_columns(const BeamAnalysis& analysis);
/// Elements: forces, moments, stresses, energy, then the extremes of forces and moments along each
/// element with their places. Unknown values are NaN.
[[nodiscard]] std::vector<BeamColumn> element_columns(const BeamAnalysis& analysis);
/// Stations at equal distances along each element, one element after the other: their places,
/// forces and moments there, equivalent stress and utilisation. @param count  of an element, >= 2
[[nodiscard]] std::vector<BeamColumn> station_columns(const BeamAnalysis& analysis, int count);

/// Rotation vectors from rest, 3 x nodes [rad], of length at most pi.
[[nodiscard]] Eigen::Matrix3Xd rotation_vectors(const beams::BeamState& state);

}  // namespace limber::session::detail
