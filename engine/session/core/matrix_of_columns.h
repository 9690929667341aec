#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace limber::session {

/// Frames of a result from vectors of one size; no vectors, no rows.
template <class Number>
[[nodiscard]] std::shared_ptr<const Eigen::MatrixX<Number>> matrix_of_columns(
    const std::vector<Eigen::VectorX<Number>>& columns) {
  auto matrix = std::make_shared<Eigen::MatrixX<Number>>(columns.empty() ? 0 : columns[0].size(),
                                                         static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i)
    matrix->col(static_cast<Eigen::Index>(i)) = columns[i];
  return matrix;
}

}  // namespace limber::session
