#include "engine/rods/design/layout_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/rods/design/shape_functions.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {
namespace {

constexpr RodMaterial kAny{1, 0.3};  // of the modulus heights do not depend
constexpr int kEdges = 6;            // of a segment

struct OpenedGrid {
  Eigen::Matrix3Xd joints;
  double height = 0;
};

/// Nothing: it does not open as far, or is not drawn.
std::optional<OpenedGrid> opened(const GridLines& grid, const StraightLayout& layout,
                                 double least_angle, const SectionStiffness& rods) {
  LineMesh lines;
  lines.vertices = draw(grid, layout);
  if (!is_regular(grid, lines.vertices, least_angle)) return std::nullopt;
  lines.edges = grid.edge_columns();
  const LinkageModel model(build_linkage_graph(lines), kEdges,
                           {rods.stretching, rods.bending_1, rods.bending_2, rods.torsion});
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions open;
  open.mean_opening_angle = layout.open_angle;
  if (deploy(equilibrium, state, open).status != DeploymentStatus::kReached) return std::nullopt;
  return OpenedGrid{joint_positions(state),
                    std::sqrt(Flatness(model).value(state) / static_cast<double>(grid.joints()))};
}

}  // namespace

StraightLayout driven(StraightLayout layout, double drive) {
  layout.curvature.mean *= drive;
  return layout;
}

LayoutDrive drive_to_height(const GridLines& grid, const StraightLayout& layout, double height,
                            double least_angle, const Section& section) {
  constexpr int kTries = 24;                     // grids that are opened at most
  constexpr double kMaxHeightErrorShare = 0.05;  // of the height
  constexpr double kLow = 0.05;                  // of it: nothing to be extrapolated from
  constexpr double kSlope = 0.87;                // of the squared height over the drive, about
  const SectionStiffness rods =
      section_stiffness(section_properties(section), kAny, StiffAxis::kAsGiven);
  LayoutDrive best;
  double below = 0, above = std::numeric_limits<double>::infinity(), drive = 2;
  double last_drive = 0, last_square = 0;  // of a grid that left its plane; 0: of none
  for (int tries = 0; tries < kTries; ++tries) {
    std::optional<OpenedGrid> grown = opened(grid, driven(layout, drive), least_angle, rods);
    if (!grown) {
      above = drive;
      drive = 0.5 * (below + above);
      continue;
    }
    const double found = grown->height;
    // By their ratio: one that is too high has left the plane at least.
    if (!best.has_opened ||
        std::abs(std::log(found / height)) < std::abs(std::log(best.height / height)))
      best = {drive, found, true, std::move(grown->joints)};
    if (std::abs(found - height) < kMaxHeightErrorShare * height) break;
    (found < height ? below : above) = drive;
    double next = 2 * drive;
    if (found > kLow * height) {
      // Beyond the drive that buckles the plane grid, the squared height grows with the drive.
      const double square = std::pow(found / height, 2);
      double slope = kSlope;
      if (last_drive > 0 && last_drive != drive) {
        const double secant_slope = (square - last_square) / (drive - last_drive);
        if (secant_slope > 0) slope = secant_slope;
      }
      next = drive + (1 - square) / slope;
      last_drive = drive;
      last_square = square;
    }
    drive = next > below && next < above ? next : 0.5 * (below + above);
  }
  return best;
}

}  // namespace limber::rods
