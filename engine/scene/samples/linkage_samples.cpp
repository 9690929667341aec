#include "engine/scene/samples/linkage_samples.h"

#include <cmath>
#include <functional>

#include "engine/base/degrees.h"
#include "engine/base/error.h"

namespace limber::scene {
namespace {

/// Rods along both directions of a grid of vertices.
rods::LineMesh grid_lines(int rows, int columns,
                          const std::function<Eigen::Vector3d(int, int)>& place) {
  rods::LineMesh lines;
  lines.vertices.resize(3, rows * columns);
  lines.edges.resize(2, rows * (columns - 1) + columns * (rows - 1));
  const auto vertex = [&](int i, int j) { return i * columns + j; };
  int edge = 0;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      lines.vertices.col(vertex(i, j)) = place(i, j);
      if (j + 1 < columns) lines.edges.col(edge++) << vertex(i, j), vertex(i, j + 1);
      if (i + 1 < rows) lines.edges.col(edge++) << vertex(i, j), vertex(i + 1, j);
    }
  }
  return lines;
}

Linkage make_grid() {
  constexpr int kRods = 9;
  constexpr double kCell = 0.15, kHalfAngle = 10 * kDegree;
  Linkage linkage;
  linkage.name = "grid";
  linkage.lines = grid_lines(kRods, kRods, [&](int i, int j) -> Eigen::Vector3d {
    return kCell *
           Eigen::Vector3d((i + j) * std::cos(kHalfAngle), (i - j) * std::sin(kHalfAngle), 0);
  });
  return linkage;
}

Linkage make_dome() {
  constexpr int kRods = 9;
  constexpr double kCell = 0.15, kHalfAngle = 10 * kDegree, kLonger = 0.3;
  // Along a rod, cells grow towards its middle; the more, the nearer the rod is to the middle.
  const auto along = [](double s, double across) {
    const double t = 2 * s / (kRods - 1) - 1, u = 2 * across / (kRods - 1) - 1;
    return 0.5 * (kRods - 1) * (t + kLonger * (1 - u * u) * (t - t * t * t / 3));
  };
  Linkage linkage;
  linkage.name = "dome";
  linkage.lines = grid_lines(kRods, kRods, [&](int i, int j) -> Eigen::Vector3d {
    const double a = along(i, j), b = along(j, i);
    return kCell *
           Eigen::Vector3d((a + b) * std::cos(kHalfAngle), (a - b) * std::sin(kHalfAngle), 0);
  });
  return linkage;
}

/// The rulings of x^2 + y^2 = r0^2 + (z tan)^2 from z = -h to h. Rod i of one family starts at the
/// azimuth i D and turns by `kSteps` D up to its end. The other family turns in the other
/// direction. Rods cross at azimuths that are multiples of D / 2.
Linkage make_hyperboloid() {
  constexpr int kRods = 12, kSteps = 3, kLevels = 2 * kSteps + 1;
  constexpr double kRadius = 0.6, kHalfHeight = 0.9, kTurn = kFullTurn / kRods;
  const double half_turn = 0.5 * kSteps * kTurn;
  Linkage linkage;
  linkage.name = "hyperboloid";
  // Left alone, straight rods would close to a bundle: their rulings cross with a twist.
  linkage.conditions.mean_angle = 20 * kDegree;
  rods::LineMesh& lines = linkage.lines;
  lines.vertices.resize(3, kRods * kLevels);
  lines.edges.resize(2, 2 * kRods * (kLevels - 1));
  const auto vertex = [&](int level, int rod) {
    return level * kRods + ((rod % kRods) + kRods) % kRods;
  };
  int edge = 0;
  for (int level = 0; level < kLevels; ++level) {
    // From one end (-1) to the other (1) the tangent relates azimuth and height.
    const double g = 0.5 * (level - kSteps) * kTurn,
                 height_share = std::tan(g) / std::tan(half_turn);
    const double radius = kRadius * std::cos(half_turn) / std::cos(g);
    for (int rod = 0; rod < kRods; ++rod) {
      const double azimuth = rod * kTurn + half_turn + g;
      lines.vertices.col(vertex(level, rod)) << radius * std::cos(azimuth),
          radius * std::sin(azimuth), kHalfHeight * height_share;
      if (level + 1 == kLevels) continue;
      lines.edges.col(edge++) << vertex(level, rod), vertex(level + 1, rod);
      lines.edges.col(edge++) << vertex(level, rod), vertex(level + 1, rod - 1);
    }
  }
  return linkage;
}

struct LinkageSample {
  const char* name;
  Linkage (*make)();
};
constexpr LinkageSample kLinkageSamples[] = {
    {"grid", make_grid}, {"hyperboloid", make_hyperboloid}, {"dome", make_dome}};

}  // namespace

const std::vector<std::string>& linkage_sample_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const LinkageSample& sample : kLinkageSamples) result.emplace_back(sample.name);
    return result;
  }();
  return names;
}

Linkage make_linkage_sample(const std::string& name) {
  for (const LinkageSample& sample : kLinkageSamples)
    if (name == sample.name) return sample.make();
  std::string known;
  for (const LinkageSample& sample : kLinkageSamples)
    known += (known.empty() ? "" : ", ") + std::string(sample.name);
  throw Error(ErrorCode::kNotFound, "sample",
              "there is no linkage '" + name + "'; there are " + known);
}

}  // namespace limber::scene
