#include "engine/rods/design/starting_grid.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "engine/base/error.h"
#include "engine/rods/design/patch_lift.h"
#include "engine/rods/section/section_reach.h"

namespace limber::rods {
namespace {

constexpr double kFlat = 1e-3;  // total curvature of a patch that is taken for flat
// Of cells, at a total curvature of 1: about what opens grids of square patches to caps of it.
constexpr double kWideningOfCurvature = 0.3;
constexpr double kWideningOfBulged = 0.4;

/// Edges of rows, then of columns, and triples of joints that follow each other along a rod.
struct Grid {
  Grid(int width, int height) : columns(width), rows(height) {
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c + 1 < columns; ++c) edges.emplace_back(at(c, r), at(c + 1, r));
    for (int c = 0; c < columns; ++c)
      for (int r = 0; r + 1 < rows; ++r) edges.emplace_back(at(c, r), at(c, r + 1));
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c + 2 < columns; ++c)
        triples.emplace_back(at(c, r), at(c + 1, r), at(c + 2, r));
    for (int c = 0; c < columns; ++c)
      for (int r = 0; r + 2 < rows; ++r) triples.emplace_back(at(c, r), at(c, r + 1), at(c, r + 2));
  }
  [[nodiscard]] int at(int c, int r) const { return r * columns + c; }

  int columns, rows;
  std::vector<Eigen::Vector2i> edges;
  std::vector<Eigen::Vector3i> triples;
};

double length_on_surface(const PatchLift& lift, const Eigen::Vector2d& from,
                         const Eigen::Vector2d& to) {
  constexpr int kPieces = 8;
  double length = 0;
  Eigen::Vector3d last = lift(from);
  for (int k = 1; k <= kPieces; ++k) {
    const Eigen::Vector3d next = lift(from + static_cast<double>(k) / kPieces * (to - from));
    length += (next - last).norm();
    last = next;
  }
  return length;
}

/// Joints in the plane, least squares of edges' misfits and of rods' bends (Gauss-Newton). Bends
/// weigh little and less and less: they choose among the drawings that fit.
Eigen::Matrix2Xd laid_flat(const Grid& grid, const Eigen::VectorXd& lengths, double angle) {
  const auto across = static_cast<Eigen::Index>(grid.rows) * (grid.columns - 1);
  const double a = lengths.head(across).mean(), b = lengths.tail(lengths.size() - across).mean();
  Eigen::Matrix2Xd x(2, Eigen::Index{grid.columns} * grid.rows);
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c)
      x.col(grid.at(c, r)) << c * a + r * b * std::cos(angle), r * b * std::sin(angle);
  }
  constexpr int kSteps = 40;
  constexpr double kFirstBend = 0.1, kLastBend = 1e-4;
  constexpr double kHold = 1e-8;                              // of places: the plane's motions
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;  // the pattern stays
  for (int step = 0; step < kSteps; ++step) {
    const double bend =
        std::max(kLastBend, kFirstBend * std::pow(kLastBend / kFirstBend, step / (0.7 * kSteps)));
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd residual(
        static_cast<Eigen::Index>(grid.edges.size() + 2 * grid.triples.size()));
    Eigen::Index row = 0;
    for (const Eigen::Vector2i& edge : grid.edges) {
      const Eigen::Vector2d way = x.col(edge[1]) - x.col(edge[0]);
      residual[row] = way.norm() - lengths[row];
      for (int axis = 0; axis < 2; ++axis) {
        entries.emplace_back(row, 2 * edge[0] + axis, -way[axis] / way.norm());
        entries.emplace_back(row, 2 * edge[1] + axis, way[axis] / way.norm());
      }
      ++row;
    }
    for (const Eigen::Vector3i& triple : grid.triples) {
      for (int axis = 0; axis < 2; ++axis, ++row) {
        residual[row] = bend * (x(axis, triple[0]) - 2 * x(axis, triple[1]) + x(axis, triple[2]));
        entries.emplace_back(row, 2 * triple[0] + axis, bend);
        entries.emplace_back(row, 2 * triple[1] + axis, -2 * bend);
        entries.emplace_back(row, 2 * triple[2] + axis, bend);
      }
    }
    Eigen::SparseMatrix<double> jacobian(residual.size(), x.size());
    jacobian.setFromTriplets(entries.begin(), entries.end());
    Eigen::SparseMatrix<double> normal = jacobian.transpose() * jacobian;
    for (Eigen::Index i = 0; i < x.size(); ++i) normal.coeffRef(i, i) += kHold;
    if (step == 0) factor.analyzePattern(normal);
    factor.factorize(normal);
    const Eigen::VectorXd move = factor.solve(-(jacobian.transpose() * residual));
    // No joint passes another in one step.
    const double farthest = move.cwiseAbs().maxCoeff();
    const double share = std::min(1.0, 0.3 * std::min(a, b) / farthest);
    x += share * Eigen::Map<const Eigen::Matrix2Xd>(move.data(), 2, x.cols());
  }
  return x;
}

double crossing_angle(const Grid& grid, const Eigen::Matrix3Xd& points) {
  double sum = 0;
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const Eigen::Vector3d along = points.col(grid.at(c + 1, r)) - points.col(grid.at(c, r)),
                            across = points.col(grid.at(c, r + 1)) - points.col(grid.at(c, r));
      sum += std::atan2(along.cross(across).norm(), along.dot(across));
    }
  }
  return sum / ((grid.rows - 1) * (grid.columns - 1));
}

/// Where a joint is along its rod, t in [-1, 1], when cells grow towards the rod's middle, the more
/// the nearer the rod is to the middle of the patch.
double widened(double t, double across, double share) {
  return t + share * (1 - across * across) * (t - t * t * t / 3);
}

/// What angles around joints within the grid lack of full turns: positive on domes.
double total_curvature(const Grid& grid, const Eigen::Matrix3Xd& points) {
  double sum = 0;
  for (int r = 1; r + 1 < grid.rows; ++r) {
    for (int c = 1; c + 1 < grid.columns; ++c) {
      const int around[] = {grid.at(c + 1, r), grid.at(c, r + 1), grid.at(c - 1, r),
                            grid.at(c, r - 1)};
      sum += 2 * std::numbers::pi;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector3d a = points.col(around[k]) - points.col(grid.at(c, r)),
                              b = points.col(around[(k + 1) % 4]) - points.col(grid.at(c, r));
        sum -= std::atan2(a.cross(b).norm(), a.dot(b));
      }
    }
  }
  return sum;
}

/// Over the plane nearest to the points, to the side that the flat grid's z has.
Eigen::RowVectorXd heights(const Grid& grid, const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd offsets = points.colwise() - mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(offsets * offsets.transpose());
  Eigen::Vector3d normal = axes.eigenvectors().col(0);
  Eigen::Vector3d upward = Eigen::Vector3d::Zero();
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const Eigen::Vector3d along = points.col(grid.at(c + 1, r)) - points.col(grid.at(c, r)),
                            across = points.col(grid.at(c, r + 1)) - points.col(grid.at(c, r));
      upward += along.cross(across);
    }
  }
  if (normal.dot(upward) < 0) normal = -normal;
  return normal.transpose() * offsets;
}

/// In each cell: its area over the length of the rod beside it.
void measure_gaps(int columns, int rows, StartingGrid& grid) {
  grid.columns_apart = grid.rows_apart = std::numeric_limits<double>::infinity();
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      const Eigen::Vector3d corner = grid.flat.vertices.col(r * columns + c);
      const Eigen::Vector3d along = grid.flat.vertices.col(r * columns + c + 1) - corner;
      const Eigen::Vector3d across = grid.flat.vertices.col((r + 1) * columns + c) - corner;
      const double area = along.cross(across).norm();
      grid.columns_apart = std::min(grid.columns_apart, area / across.norm());
      grid.rows_apart = std::min(grid.rows_apart, area / along.norm());
    }
  }
}

}  // namespace

void StartingGridOptions::validate() const {
  const auto demand = [](bool holds, const char* field, const char* rule, double value) {
    if (holds) return;
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("must be {}, is {:g}", rule, value));
  };
  demand(columns >= 3, "columns", ">= 3", columns);
  demand(rows >= 3, "rows", ">= 3", rows);
  if (std::int64_t{columns} * rows > kMostJoints) {
    throw Error(ErrorCode::kInvalidArgument, columns >= rows ? "columns" : "rows",
                fmt::format("{} columns of {} rows are {} joints, and a grid may have {}: take "
                            "fewer columns or rows",
                            columns, rows, std::int64_t{columns} * rows, kMostJoints));
  }
  demand(flat_angle >= 0.1 && flat_angle <= std::numbers::pi / 2, "flat_angle", "in [0.1, pi/2]",
         flat_angle);
  demand(margin >= 0 && margin <= 0.4, "margin", "in [0, 0.4]", margin);
  if (widening) demand(*widening >= 0 && *widening <= 0.5, "widening", "in [0, 0.5]", *widening);
  demand(bulge >= 0 && bulge <= 1, "bulge", "in [0, 1]", bulge);
}

StartingGrid starting_grid(const SurfaceMesh& surface, const StartingGridOptions& options) {
  options.validate();
  const PatchLift lift(surface);
  const Grid grid(options.columns, options.rows);
  double widening = 0;
  const auto place = [&](int vertex) -> Eigen::Vector2d {
    const double u = 2.0 * (vertex % grid.columns) / (grid.columns - 1) - 1;
    const double v = 2.0 * (vertex / grid.columns) / (grid.rows - 1) - 1;
    const Eigen::Vector2d wide(widened(u, v, widening), widened(v, u, widening));
    return Eigen::Vector2d::Constant(options.margin) +
           (0.5 - options.margin) * (wide / widened(1, 0, widening) + Eigen::Vector2d::Ones());
  };
  StartingGrid result;
  const Eigen::Index joints = Eigen::Index{grid.columns} * grid.rows;
  const auto edges = static_cast<Eigen::Index>(grid.edges.size());
  result.deployed.vertices.resize(3, joints);
  const auto place_all = [&] {
    for (int j = 0; j < joints; ++j) result.deployed.vertices.col(j) = lift(place(j));
  };
  place_all();
  const double curvature = total_curvature(grid, result.deployed.vertices);
  const double widest = options.widening.value_or(options.bulge > 0 ? kWideningOfBulged : 0);
  if (widest > 0 && std::abs(curvature) > kFlat) {
    widening = std::copysign(
        std::min(widest, kWideningOfCurvature * std::sqrt(std::abs(curvature))), curvature);
    place_all();
  }
  result.deployed.edges.resize(2, edges);
  result.rest_lengths.resize(edges);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const Eigen::Vector2i& edge = grid.edges[static_cast<std::size_t>(e)];
    result.deployed.edges.col(e) = edge;
    result.rest_lengths[e] = length_on_surface(lift, place(edge[0]), place(edge[1]));
  }
  result.flat.edges = result.deployed.edges;
  result.flat.vertices = Eigen::Matrix3Xd::Zero(3, joints);
  result.flat.vertices.topRows<2>() = laid_flat(grid, result.rest_lengths, options.flat_angle);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const double length = (result.flat.vertices.col(result.flat.edges(1, e)) -
                           result.flat.vertices.col(result.flat.edges(0, e)))
                              .norm();
    result.misfit = std::max(result.misfit, std::abs(length / result.rest_lengths[e] - 1));
  }
  if (options.bulge > 0)
    result.flat.vertices.row(2) = options.bulge * heights(grid, result.deployed.vertices);
  result.mean_angle = crossing_angle(grid, result.deployed.vertices);
  measure_gaps(grid.columns, grid.rows, result);
  return result;
}

StartingGrid starting_grid(SurfaceMesh surface, const SurfacePlacement& placement,
                           const StartingGridOptions& options) {
  placement.validate();
  const Eigen::Matrix3d turn = placement.rotation.normalized().toRotationMatrix();
  surface.vertices = (placement.scale * turn * surface.vertices).colwise() + placement.translation;
  return starting_grid(surface, options);
}

void demand_room(const StartingGrid& grid, const StartingGridOptions& options,
                 const Section& section) {
  validate(section);
  const double thick = outline_size(section).minCoeff();
  const auto demand = [thick](const char* field, int count, double apart) {
    if (apart >= thick) return;
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("the rods of {} {} lie {:.3g} apart when the grid lies flat, and are "
                            "{:.3g} thick: take fewer {}, or a smaller section",
                            count, field, apart, thick, field));
  };
  demand("columns", options.columns, grid.columns_apart);
  demand("rows", options.rows, grid.rows_apart);
  const Eigen::Index across = Eigen::Index{options.rows} * (options.columns - 1);
  const Eigen::Index along = grid.rest_lengths.size() - across;
  const double longest = std::max(grid.rest_lengths.head(across).sum() / options.rows,
                                  grid.rest_lengths.tail(along).sum() / options.columns);
  if (longest > kMostSlender * thick) {
    throw Error(
        ErrorCode::kInvalidArgument, "section",
        fmt::format("the rods would be {:.3g} long and {:.3g} thick, more than {:g} to 1: is "
                    "the section in the surface's length unit?",
                    longest, thick, kMostSlender));
  }
}

}  // namespace limber::rods
