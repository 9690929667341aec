#include "engine/rods/design/starting_grid.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/design/grid_on_surface.h"
#include "engine/rods/design/grid_remarks.h"
#include "engine/rods/design/layout_drive.h"
#include "engine/rods/section/section_reach.h"

namespace limber::rods {
namespace {

constexpr double kUnknownDrive = 3;  // where nothing is known of the rods
constexpr double kFlatHeightShare =
    1e-4;                        // heights that are nothing, as a share of the patch's size
constexpr double kMissed = 0.2;  // of the surface's height: that is no opening
constexpr double kThin = 0.5;    // of a rod's thickness: heights that it hides
constexpr double kFan = 0.02;    // of sides over the patch's size: smallest fan that is reported
constexpr double kLeastOpening = 0.1;  // [rad]
constexpr double kLeastAngle = 0.6;    // of cells, as a share of the flat angle
constexpr double kTwin = 64;           // joints of the grid that is opened in place of larger ones

double size_of(const StraightLayout& layout) {
  const auto extent = [](const Eigen::VectorXd& at) { return at[at.size() - 1] - at[0]; };
  return std::hypot(extent(layout.columns), extent(layout.rows));
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

/// If the plane has no room for a layout, its rods fan out less first, then it curves less.
StraightLayout with_room(const GridLines& lines, StraightLayout layout) {
  constexpr int kTries = 30;     // reductions at most, of fan and of curvature each
  constexpr double kLess = 0.8;  // factor of a reduction
  const auto has_room = [&] {
    return is_regular(lines, draw(lines, layout), kLeastAngle * layout.flat_angle);
  };
  for (int k = 0; k < kTries; ++k) {
    if (has_room()) return layout;
    fan_less(layout, kLess);
  }
  fan_less(layout, 0);
  for (int k = 0; k < kTries; ++k) {
    if (has_room()) return layout;
    curve_less(layout, kLess);
  }
  curve_less(layout, 0);
  return layout;
}

StraightLayout parallel(StraightLayout layout) {
  fan_less(layout, 0);
  curve_less(layout, 0);
  return layout;
}

StartingGrid drawn(const GridOnSurface& on_surface, const StraightLayout& layout) {
  const GridLines& lines = on_surface.lines;
  StartingGrid grid;
  grid.flat.vertices = draw(lines, layout);
  grid.flat.edges = lines.edge_columns();
  const Eigen::Index edges = on_surface.lengths.size();
  grid.rest_lengths.resize(edges);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const Eigen::Vector2i edge = grid.flat.edges.col(e);
    grid.rest_lengths[e] =
        (grid.flat.vertices.col(edge[1]) - grid.flat.vertices.col(edge[0])).norm();
    grid.misfit = std::max(grid.misfit, std::abs(grid.rest_lengths[e] / on_surface.lengths[e] - 1));
  }
  grid.deployed = {on_surface.points, grid.flat.edges};
  grid.mean_angle = layout.open_angle;
  measure_gaps(lines.columns, lines.rows, grid);
  return grid;
}

/// As the surface's heights are; together about what the weight of rods is that sag under it by
/// their length.
Eigen::VectorXd push_of(const GridOnSurface& on_surface, double size, const Section& section) {
  constexpr double kPushShare = 0.3;  // of I / size^2: the largest force over Young's modulus
  const Eigen::VectorXd heights = heights_of(on_surface);
  const double highest = heights.cwiseAbs().maxCoeff();
  if (!(highest > 0)) return Eigen::VectorXd::Zero(heights.size());
  const double bending =
      section_stiffness(section_properties(section), {1, 0}, StiffAxis::kAsGiven).bending_2;
  return kPushShare * bending / (size * size * highest) * heights;
}

struct FoundDrive {
  double drive = kUnknownDrive;
  std::string remark;
};

/// With which a grid of such rods opens to the surface.
FoundDrive drive_of(const GridOnSurface& twin, const StartingGridOptions& options) {
  const StraightLayout layout = with_room(twin.lines, layout_of(twin, options.flat_angle));
  const double target_height = curved_height(twin.points, layout.curvature.mean);
  const LayoutDrive found = drive_to_height(twin.lines, layout, target_height,
                                            kLeastAngle * options.flat_angle, *options.section);
  if (!found.has_opened) return {};
  if (!(found.height > kMissed * target_height)) {
    throw Error(
        ErrorCode::kInvalidArgument, "section",
        fmt::format(
            "opened, a grid of such rods stays in its plane, or nearly: {:.3g} "
            "high for {:.3g} of the surface, both root mean square. Rods leave it "
            "that are stiff sideways, as strips of thin rectangles are that lie flat: wider "
            "than they are high",
            found.height, target_height));
  }
  const GridCurvature curvature = grid_curvature(twin.lines, twin.points);
  return {found.drive,
          describe_distance(distance_between(found.joints, twin.points), height_of(twin.points),
                            curved_height(twin.points, curvature.mean), curvature)};
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
  if (std::int64_t{columns} * rows > kMaxJoints) {
    throw Error(ErrorCode::kInvalidArgument, columns >= rows ? "columns" : "rows",
                fmt::format("{} columns of {} rows are {} joints, and a grid may have {}: take "
                            "fewer columns or rows",
                            columns, rows, std::int64_t{columns} * rows, kMaxJoints));
  }
  demand(flat_angle >= 0.1 && flat_angle <= std::numbers::pi / 2, "flat_angle",
         "in [5.73, 90] degrees", flat_angle / kDegree);
  demand(margin >= 0 && margin <= 0.4, "margin", "in [0, 0.4]", margin);
  if (drive) demand(*drive >= 0 && *drive <= 1e3, "drive", "in [0, 1000]", *drive);
  if (section) rods::validate(*section);
}

StartingGrid starting_grid(const SurfaceMesh& surface, const StartingGridOptions& options) {
  options.validate();
  const PatchLift lift(surface);
  const GridOnSurface on_surface(lift, options.columns, options.rows, options.margin);
  const StraightLayout layout = layout_of(on_surface, options.flat_angle);
  const auto as_driven = [&](double drive, const std::string& remark = "") {
    const double fan = std::hypot(layout.rows_widen, layout.columns_widen);
    const StraightLayout chosen =
        drive == 0 ? parallel(layout) : with_room(on_surface.lines, driven(layout, drive));
    StartingGrid grid = drawn(on_surface, chosen);
    if (options.section) {
      demand_room(grid, options, *options.section);
      grid.push = push_of(on_surface, size_of(layout), *options.section);
    }
    grid.remark = remark;
    if (drive > 0 && fan * size_of(layout) > kFan) {
      const std::string fan_remark =
          describe_fan(std::hypot(chosen.rows_widen, chosen.columns_widen) / fan);
      grid.remark += (remark.empty() || fan_remark.empty() ? "" : "; ") + fan_remark;
    }
    return grid;
  };
  if (options.section)  // before linkages of it are opened
    demand_room(drawn(on_surface, parallel(layout)), options, *options.section);
  const bool is_flat = height_of(on_surface.points) < kFlatHeightShare * size_of(layout);
  if (!(layout.open_angle > options.flat_angle + kLeastOpening)) {
    if (is_flat) return as_driven(0);
    throw Error(ErrorCode::kInvalidArgument, "flat_angle",
                fmt::format("the grid is to open, but rods cross at {:.3g} degrees on the surface, "
                            "and at {:.3g} when it is flat",
                            layout.open_angle / kDegree, options.flat_angle / kDegree));
  }
  if (options.drive) return as_driven(*options.drive);
  if (is_flat) return as_driven(1);
  if (!options.section) return as_driven(kUnknownDrive);
  // As dense in one direction as in the other, so that it is as stiff.
  const double less = std::min(1.0, std::sqrt(kTwin / (double(options.columns) * options.rows)));
  const auto fewer = [less](int count) {
    return std::max(3, static_cast<int>(std::lround(less * count)));
  };
  const auto [drive, remark] =
      less == 1
          ? drive_of(on_surface, options)
          : drive_of({lift, fewer(options.columns), fewer(options.rows), options.margin}, options);
  return as_driven(drive, remark);
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
  constexpr double kStout = 0.1;  // of a rod's length: no rod
  const double thick = outline_size(section).minCoeff();
  const Eigen::Index across = Eigen::Index{options.rows} * (options.columns - 1);
  const Eigen::Index along = grid.rest_lengths.size() - across;
  const double longest = std::max(grid.rest_lengths.head(across).sum() / options.rows,
                                  grid.rest_lengths.tail(along).sum() / options.columns);
  if (thick > kStout * longest) {
    throw Error(ErrorCode::kInvalidArgument, "section",
                fmt::format("the rods would be {:.3g} long and {:.3g} thick: is the section in the "
                            "surface's length unit?",
                            longest, thick));
  }
  const auto demand = [thick](const char* field, int count, double apart) {
    if (apart >= thick) return;
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("the rods of {} {} lie {:.3g} apart when the grid is flat, and are "
                            "{:.3g} thick: take fewer {}, or a smaller section",
                            count, field, apart, thick, field));
  };
  demand("columns", options.columns, grid.columns_apart);
  demand("rows", options.rows, grid.rows_apart);
  if (longest > kMaxSlenderness * thick) {
    throw Error(
        ErrorCode::kInvalidArgument, "section",
        fmt::format("the rods would be {:.3g} long and {:.3g} thick, more than {:g} to 1: is "
                    "the section in the surface's length unit?",
                    longest, thick, kMaxSlenderness));
  }
}

}  // namespace limber::rods
