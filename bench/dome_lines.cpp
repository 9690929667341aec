#include "bench/dome_lines.h"

#include <cmath>

#include "engine/base/degrees.h"

namespace limber::bench {

rods::LineMesh dome_lines(int rods) {
  constexpr double kLength = 1.2, kHalfAngle = 10 * kDegree, kLonger = 0.3;
  const double last = rods - 1;
  const auto along = [&](double s, double across) {
    const double t = 2 * s / last - 1, u = 2 * across / last - 1;
    return 0.5 * kLength * (t + kLonger * (1 - u * u) * (t - t * t * t / 3));
  };
  rods::LineMesh lines;
  lines.vertices.resize(3, rods * rods);
  lines.edges.resize(2, 2 * rods * (rods - 1));
  int edge = 0;
  for (int i = 0; i < rods; ++i) {
    for (int j = 0; j < rods; ++j) {
      const int vertex = i * rods + j;
      const double a = along(i, j), b = along(j, i);
      lines.vertices.col(vertex) << (a + b) * std::cos(kHalfAngle), (a - b) * std::sin(kHalfAngle),
          0;
      if (j + 1 < rods) lines.edges.col(edge++) << vertex, vertex + 1;
      if (i + 1 < rods) lines.edges.col(edge++) << vertex, vertex + rods;
    }
  }
  return lines;
}

}  // namespace limber::bench
