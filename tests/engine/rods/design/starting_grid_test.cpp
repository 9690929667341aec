#include "engine/rods/design/starting_grid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <ctime>
#include <numbers>

#include "engine/base/error.h"
#include "engine/rods/design/mesh_surface.h"
#include "engine/rods/design/patch_lift.h"
#include "engine/rods/design/patch_map.h"
#include "engine/rods/design/placed_surface.h"
#include "engine/rods/design/shape_functions.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "tests/engine/rods/design/small_patches.h"
#include "tests/support/dense.h"

namespace limber::rods {
namespace {

using testing::field;

SurfaceMesh dome() {
  return field(24, [](double x, double y) { return 60 * (1 - 0.5 * (x * x + y * y)); });
}

std::string refused_message(const SurfaceMesh& mesh) {
  try {
    (void)map_patch_to_square(mesh);
  } catch (const Error& error) {
    EXPECT_TRUE(error.field().starts_with("surface.triangles")) << error.field();
    return error.what();
  }
  return "none";
}

TEST(PatchMap, IsOneToOne) {
  for (const double height : {0.0, 60.0, 200.0}) {
    const SurfaceMesh mesh = field(20, [&](double x, double y) {
      return height * (1 - x * x) * std::cos(2 * y) + 20 * x * y;
    });
    const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
    EXPECT_GE(map.minCoeff(), -1e-12);
    EXPECT_LE(map.maxCoeff(), 1 + 1e-12);
    double area = 0;
    int side = 0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      const Eigen::Vector3i corner = mesh.triangles.col(t);
      const Eigen::Vector2d a = map.col(corner[1]) - map.col(corner[0]),
                            b = map.col(corner[2]) - map.col(corner[0]);
      const double twice = a.x() * b.y() - a.y() * b.x();
      if (side == 0) side = twice > 0 ? 1 : -1;
      EXPECT_GT(side * twice, 0) << t;
      area += side * twice / 2;
    }
    EXPECT_NEAR(area, 1, 1e-9);
  }
}

TEST(PatchMap, ASquareIsItsOwnMap) {
  const SurfaceMesh mesh = field(10, [](double, double) { return 0.0; });
  const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
  for (Eigen::Index i = 0; i < map.cols(); ++i) {
    const Eigen::Vector2d at = (mesh.vertices.col(i).head<2>().array() + 100) / 200;
    EXPECT_LT((map.col(i) - at).norm(), 1e-10) << i;
  }
}

TEST(PatchMap, WhatIsNoPatchIsRefused) {
  SurfaceMesh closed;
  closed.vertices.resize(3, 4);
  closed.vertices << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  closed.triangles.resize(3, 4);
  closed.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
  EXPECT_NE(refused_message(closed).find("closed"), std::string::npos);
  SurfaceMesh holed = field(4, [](double, double) { return 0.0; });
  holed.triangles.col(10) = holed.triangles.col(0);
  EXPECT_NE(refused_message(holed), "none");  // a triangle twice and a hole
  holed = field(4, [](double, double) { return 0.0; });
  for (const int t : {10, 11})
    holed.triangles.col(t) = holed.triangles.col(holed.triangles.cols() + 10 - 1 - t);
  holed.triangles.conservativeResize(3, holed.triangles.cols() - 2);
  EXPECT_NE(refused_message(holed).find("rim"), std::string::npos);
  SurfaceMesh crowded = closed;
  crowded.vertices.conservativeResize(3, 5);
  crowded.vertices.col(4) << 1, 1, 1;
  crowded.triangles.resize(3, 3);
  crowded.triangles << 0, 0, 0, 1, 1, 1, 2, 3, 4;
  EXPECT_NE(refused_message(crowded).find("more than two"), std::string::npos);
  EXPECT_NE(refused_message({}).find("empty"), std::string::npos);
}

/// Vertices beside where a regular field has them, so that neighbours weigh each other differently.
SurfaceMesh uneven(int n) {
  SurfaceMesh mesh =
      field(n, [](double x, double y) { return 60 * std::cos(2 * x) * (1 - y * y); });
  for (int j = 1; j < n; ++j) {
    for (int i = 1; i < n; ++i) {
      mesh.vertices(0, j * (n + 1) + i) += 60.0 / n * std::sin(7.3 * i + 3.1 * j);
      mesh.vertices(1, j * (n + 1) + i) += 60.0 / n * std::cos(5.1 * i + 2.7 * j);
    }
  }
  return mesh;
}

/// By asking every triangle.
Eigen::Vector3d lifted(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& map,
                       const Eigen::Vector2d& at) {
  Eigen::Vector3d best = Eigen::Vector3d::Constant(-1e300), point;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Eigen::Matrix3d places;
    for (int k = 0; k < 3; ++k) places.col(k) << map.col(mesh.triangles(k, t)), 1;
    const Eigen::Vector3d shares = places.inverse() * Eigen::Vector3d(at.x(), at.y(), 1);
    if (!(shares.minCoeff() > best.minCoeff())) continue;
    best = shares;
    point = corners(mesh, t) * shares;
  }
  return point;
}

TEST(PatchLift, FindsWhatASearchThroughAllTrianglesFinds) {
  const SurfaceMesh mesh = uneven(80);
  const PatchLift lift(mesh);
  const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
  const auto demand_same = [&](const Eigen::Vector2d& at) {
    EXPECT_LT((lift(at) - lifted(mesh, map, at)).norm(), 1e-8) << at.transpose();
  };
  for (int i = 0; i <= 12; ++i)
    for (int j = 0; j <= 12; ++j) demand_same({i / 12.0, j / 12.0});
  for (const Eigen::Index vertex : {Eigen::Index{0}, Eigen::Index{80}, Eigen::Index{3333}}) {
    demand_same(map.col(vertex));
    EXPECT_LT((lift(map.col(vertex)) - mesh.vertices.col(vertex)).norm(), 1e-9);
  }
  demand_same({1 + 1e-7, 0.3});  // no box has it
}

TEST(PatchMap, OfAnUnevenPatchIsTheMeanOfNeighboursAndQuick) {
  const SurfaceMesh mesh = uneven(200);
  const std::clock_t begun = std::clock();
  const StartingGrid grid = starting_grid(mesh, {.columns = 50, .rows = 50});
  // Of this process; a search through all triangles for each point of the grid takes minutes.
  EXPECT_LT(static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC, 12);
  EXPECT_EQ(grid.deployed.vertex_count(), 2500);
  const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
  // In the middle each place is the mean of its neighbours' by their mean value weights.
  for (const int vertex : {100 * 201 + 100, 37 * 201 + 150, 199 * 201 + 1}) {
    Eigen::Vector2d pulled = Eigen::Vector2d::Zero();
    double sum = 0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (mesh.triangles(k, t) != vertex) continue;
        const int b = mesh.triangles((k + 1) % 3, t), c = mesh.triangles((k + 2) % 3, t);
        const Eigen::Vector3d x = mesh.vertices.col(b) - mesh.vertices.col(vertex),
                              y = mesh.vertices.col(c) - mesh.vertices.col(vertex);
        const double half = std::tan(0.5 * std::atan2(x.cross(y).norm(), x.dot(y)));
        pulled += half / x.norm() * map.col(b) + half / y.norm() * map.col(c);
        sum += half / x.norm() + half / y.norm();
      }
    }
    EXPECT_LT((pulled / sum - map.col(vertex)).norm(), 1e-11);
  }
}

double measured_height(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd offsets = points.colwise() - points.rowwise().mean();
  return reference::singular_values(offsets)[2] / std::sqrt(static_cast<double>(points.cols()));
}

/// Largest sine of an angle between edges that follow each other along a rod.
double largest_bend(const LineMesh& lines, int columns, int rows) {
  double largest = 0;
  const auto look = [&](int a, int b, int c) {
    const Eigen::Vector3d first = (lines.vertices.col(b) - lines.vertices.col(a)).normalized(),
                          next = (lines.vertices.col(c) - lines.vertices.col(b)).normalized();
    largest = std::max(largest, first.cross(next).norm());
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int at = r * columns + c;
      if (c + 2 < columns) look(at, at + 1, at + 2);
      if (r + 2 < rows) look(at, at + columns, at + 2 * columns);
    }
  }
  return largest;
}

TEST(StartingGrid, HasStraightRodsInThePlaneAndJointsOnTheSurface) {
  const SurfaceMesh mesh = dome();
  const MeshSurface surface(mesh);
  const StartingGrid grid = starting_grid(mesh, {.columns = 7, .rows = 9});
  ASSERT_EQ(grid.flat.vertex_count(), 63);
  ASSERT_EQ(grid.flat.edges, grid.deployed.edges);
  for (Eigen::Index j = 0; j < 63; ++j) {
    const Eigen::Vector3d x = grid.deployed.vertices.col(j);
    EXPECT_LT((surface.closest(x).position - x).norm(), 1e-10);
    EXPECT_EQ(grid.flat.vertices(2, j), 0);
  }
  EXPECT_LT(largest_bend(grid.flat, 7, 9), 1e-12);
  EXPECT_GT(largest_bend(grid.deployed, 7, 9), 0.01);
  double misfit = 0, mean = 0;
  for (Eigen::Index e = 0; e < grid.rest_lengths.size(); ++e) {
    const auto length = [&](const LineMesh& lines) {
      return (lines.vertices.col(lines.edges(1, e)) - lines.vertices.col(lines.edges(0, e))).norm();
    };
    EXPECT_EQ(grid.rest_lengths[e], length(grid.flat));
    misfit = std::max(misfit, std::abs(grid.rest_lengths[e] / length(grid.deployed) - 1));
    mean += (grid.rest_lengths[e] / length(grid.deployed) - 1) /
            static_cast<double>(grid.rest_lengths.size());
  }
  EXPECT_NEAR(grid.misfit, misfit, 0.02) << "chords for lines on the surface";
  EXPECT_LT(grid.misfit, 0.6);
  EXPECT_LT(std::abs(mean), 0.02);
  EXPECT_GT(grid.mean_angle, 1.2);
  EXPECT_LT(grid.mean_angle, 1.9);
}

TEST(StartingGrid, OfAPlaneIsAParallelogram) {
  const SurfaceMesh mesh = field(8, [](double, double) { return 0.0; });
  for (const double angle : {0.5, 1.5, std::numbers::pi / 2}) {
    const StartingGrid grid =
        starting_grid(mesh, {.columns = 5, .rows = 4, .flat_angle = angle, .margin = 0});
    EXPECT_NEAR(grid.mean_angle, std::numbers::pi / 2, 1e-9);
    EXPECT_LT(grid.misfit, 1e-9);
    const LinkageGraph graph = build_linkage_graph(grid.flat);
    for (const Joint& joint : graph.joints)
      EXPECT_NEAR(std::min(joint.opening_angle, std::numbers::pi - joint.opening_angle), angle,
                  1e-6);
  }
}

/// z = a x^2 + b y^2 + c x y over a square of side 200, x and y to 1.
SurfaceMesh quadric(double a, double b, double c = 0) {
  return field(24, [&](double x, double y) { return a * x * x + b * y * y + c * x * y; });
}

constexpr Rectangle kNarrowStrip{2, 0.4};
constexpr double kModulus = 200e3;

/// Opened, free but for its mean angle.
struct Opened {
  Opened(const StartingGrid& grid, const Section& section) : model(model_of(grid, section)) {
    LinkageEquilibrium equilibrium(model);
    LinkageState flat(model);
    const EquilibriumReport report = equilibrium.solve(flat, Conditions{});
    EXPECT_TRUE(report.converged()) << report.message;
    flat_height = measured_height(joint_positions(flat));
    flat_energy = ElasticEnergy(model).value(flat);
    LinkageState open = flat;
    Conditions opened;
    opened.mean_opening_angle = grid.mean_angle;
    const DeploymentReport deployment = deploy(equilibrium, open, opened);
    EXPECT_EQ(deployment.status, DeploymentStatus::kReached) << deployment.message;
    joints = joint_positions(open);
    height = measured_height(joints);
    energy = ElasticEnergy(model).value(open);
  }
  static LinkageModel model_of(const StartingGrid& grid, const Section& section) {
    const SectionStiffness rods = section_stiffness(section_properties(section), {kModulus, 0.3});
    return {build_linkage_graph(grid.flat),
            6,
            {rods.stretching, rods.bending_1, rods.bending_2, rods.torsion}};
  }
  LinkageModel model;
  double flat_height = 0, flat_energy = 0, height = 0, energy = 0;
  Eigen::Matrix3Xd joints;
};

TEST(StartingGrid, IsFlatWithoutStressAndOpensToTheSurface) {
  for (const SurfaceMesh& mesh : {quadric(-10, -10), quadric(20, 20), quadric(12, -12)}) {
    const StartingGrid grid =
        starting_grid(mesh, {.columns = 6, .rows = 7, .section = kNarrowStrip});
    const Opened opened(grid, kNarrowStrip);
    EXPECT_LT(opened.flat_height, 1e-9);
    EXPECT_LT(opened.flat_energy, 1e-12 * opened.energy);
    EXPECT_NEAR(opened.height, measured_height(grid.deployed.vertices),
                0.1 * measured_height(grid.deployed.vertices));
  }
}

TEST(StartingGrid, LargeOnesOpenAsTheirSmallTwinsDo) {
  const SurfaceMesh mesh = quadric(-20, -20);
  const StartingGrid grid =
      starting_grid(mesh, {.columns = 14, .rows = 11, .section = kNarrowStrip});
  const double wanted = measured_height(grid.deployed.vertices);
  EXPECT_NEAR(Opened(grid, kNarrowStrip).height, wanted, 0.2 * wanted);
}

TEST(StartingGrid, StiffRodsTakeMoreThanTheSurfacesCurvature) {
  const SurfaceMesh mesh = quadric(-10, -10);
  StartingGridOptions options{.columns = 6, .rows = 6, .drive = 1.0};
  EXPECT_LT(Opened(starting_grid(mesh, options), kNarrowStrip).height, 0.1);
  options.drive = 0;
  const StartingGrid parallel = starting_grid(mesh, options);
  EXPECT_EQ(parallel.flat.vertices.row(2).norm(), 0);
  EXPECT_LT(Opened(parallel, kNarrowStrip).height, 1e-6);
}

TEST(StartingGrid, RodsThatStayInThePlaneAreRefused) {
  const SurfaceMesh mesh = quadric(-10, -10);
  const StartingGridOptions options{
      .columns = 6, .rows = 6, .flat_angle = 1.42, .section = Rectangle{12, 12}};
  try {
    (void)starting_grid(mesh, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(error.field(), "section");
    EXPECT_NE(std::string(error.what()).find("stays in its plane"), std::string::npos);
  }
}

TEST(StartingGrid, MustBeAbleToOpen) {
  StartingGridOptions options{.columns = 5, .rows = 5, .flat_angle = 1.5};
  try {
    (void)starting_grid(quadric(20, 20), options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "flat_angle");
  }
}

TEST(StartingGrid, SurfacesThatCurveToBothSidesByTurnsStillHaveOne) {
  const SurfaceMesh mesh = field(40, [](double x, double y) {
    return 15 * std::sin(5 * x) * std::cos(4 * y) + 40 * std::exp(-6 * (x * x + y * y));
  });
  const StartingGrid grid = starting_grid(mesh, {.columns = 9, .rows = 8});
  EXPECT_LT(largest_bend(grid.flat, 9, 8), 1e-12);
  EXPECT_NO_THROW((void)build_linkage_graph(grid.flat));
}

TEST(StartingGrid, OnPatchesThatWidenRodsFanOut) {
  const SurfaceMesh mesh = testing::cells(16, [](int i, int j) {
    const double x = i / 8.0 - 1, y = j / 8.0 - 1;
    return Eigen::Vector3d(150 * x * (1 + 0.2 * y), 100 * y, 0);
  });
  const StartingGrid grid =
      starting_grid(mesh, {.columns = 5, .rows = 5, .flat_angle = 1.2, .margin = 0});
  const auto length = [&](int row) {
    return (grid.flat.vertices.col(5 * row + 4) - grid.flat.vertices.col(5 * row)).norm();
  };
  EXPECT_NEAR(length(4) / length(0), 1.2 / 0.8, 0.1);
}

TEST(StartingGrid, IsPushedToTheSideOfItsSurface) {
  for (const SurfaceMesh& mesh :
       {quadric(-20, -20), quadric(20, 20), quadric(20, -20), quadric(-20, 20)}) {
    const StartingGrid grid =
        starting_grid(mesh, {.columns = 6, .rows = 6, .section = kNarrowStrip});
    ASSERT_EQ(grid.push.size(), 36);
    EXPECT_NEAR(grid.push.sum(), 0, 1e-9 * grid.push.cwiseAbs().sum());
    const LinkageModel model = Opened::model_of(grid, kNarrowStrip);
    // Far weaker and stronger ones tell the side as well.
    for (const double strength : {0.03, 1.0, 10.0}) {
      Conditions open;
      open.mean_opening_angle = grid.mean_angle;
      open.pins = {{21}};
      for (int j = 0; j < 36; ++j)
        open.loads.push_back({j, Eigen::Vector3d(0, 0, strength * kModulus * grid.push[j])});
      LinkageEquilibrium equilibrium(model);
      LinkageState state(model);
      ASSERT_EQ(deploy(equilibrium, state, open).status, DeploymentStatus::kReached);
      Conditions free = open;
      free.loads.clear();
      ASSERT_EQ(deploy(equilibrium, state, open, free).status, DeploymentStatus::kReached);
      const Eigen::Matrix3Xd joints = joint_positions(state);
      const SurfacePlacement fit = fitted({}, grid.deployed.vertices, joints);
      const double apart = ((fit.rotation.toRotationMatrix() * grid.deployed.vertices).colwise() +
                            fit.translation - joints)
                               .norm() /
                           6;
      EXPECT_LT(apart, 0.8 * measured_height(grid.deployed.vertices)) << strength;
    }
  }
}

TEST(StartingGrid, RemarksNameWhatWillHinderADesign) {
  const StartingGridOptions options{.columns = 6, .rows = 6, .section = kNarrowStrip};
  EXPECT_EQ(starting_grid(quadric(-20, -20), options).remark, "");
  EXPECT_EQ(starting_grid(quadric(10, -10), options).remark, "");
  const auto expect_remark = [&](const SurfaceMesh& mesh, const char* words) {
    const std::string remark = starting_grid(mesh, options).remark;
    EXPECT_NE(remark.find(words), std::string::npos) << remark;
  };
  expect_remark(quadric(0, 0, 20), "twisted along the rods");
  expect_remark(quadric(-20, 0), "in one direction only");
  expect_remark(testing::cells(16,
                               [](int i, int j) {
                                 const double x = i / 8.0 - 1, y = j / 8.0 - 1;
                                 return Eigen::Vector3d(150 * x * (1 + 0.3 * y), 100 * y,
                                                        20 * (1 - x * x - y * y));
                               }),
                "a larger flat_angle leaves them more room");
}

TEST(StartingGrid, ShallowSurfacesHaveShallowGrids) {
  for (const double rise : {3.0, 1.0, 0.3, 0.1}) {
    const StartingGrid grid =
        starting_grid(quadric(-rise, -rise), {.columns = 6, .rows = 6, .section = kNarrowStrip});
    const double wanted = measured_height(grid.deployed.vertices);
    EXPECT_NEAR(Opened(grid, kNarrowStrip).height, wanted, 0.3 * wanted) << rise;
  }
}

TEST(StartingGrid, IsLaidOverTheSurfaceAsItIsPlaced) {
  const SurfaceMesh mesh = dome();
  SurfacePlacement placement;
  placement.scale = 0.5;
  placement.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  placement.translation = {1, 2, 3};
  const StartingGrid grid = starting_grid(mesh, placement, {.columns = 5, .rows = 5});
  const PlacedSurface placed(std::make_shared<MeshSurface>(mesh), placement);
  for (const auto& x : grid.deployed.vertices.colwise())
    EXPECT_LT((placed.closest(x).position - x).norm(), 1e-9);
}

TEST(StartingGrid, RodsNeedRoomBetweenThem) {
  const StartingGridOptions options{.columns = 5, .rows = 9, .flat_angle = 0.5};
  const StartingGrid grid = starting_grid(dome(), options);
  const auto refused = [&](const Section& section) -> std::string {
    try {
      demand_room(grid, options, section);
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(refused(Rectangle{6, 1.5}), "none");
  EXPECT_EQ(refused(Rectangle{30, 1.02 * grid.rows_apart}), "rows");
  EXPECT_EQ(refused(Rectangle{60, 1.02 * grid.columns_apart}), "columns");
  EXPECT_EQ(refused(Rectangle{0, 1}), "section.width");
  EXPECT_EQ(refused(Rectangle{6, 0.015}), "none");
  EXPECT_EQ(refused(Rectangle{6e-3, 1.5e-3}), "section")
      << "metres beside a surface in millimetres";
}

TEST(PlacedSurface, IsPutWherePointsFit) {
  SurfacePlacement placement;
  placement.scale = 2;
  placement.translation = {1, 0, -1};
  Eigen::Matrix3Xd own(3, 4);
  own << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3Xd points = (2 * own).colwise() + placement.translation;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(3, -2, 5);
  const Eigen::Matrix3Xd wanted = (turn * points).colwise() + shift;
  const SurfacePlacement fit = fitted(placement, points, wanted);
  EXPECT_EQ(fit.scale, 2);
  const Eigen::Matrix3Xd found =
      (2 * (fit.rotation.toRotationMatrix() * own)).colwise() + fit.translation;
  EXPECT_LT((found - wanted).norm(), 1e-12);
  // Not turned inside out.
  Eigen::Matrix3Xd mirrored = wanted;
  mirrored.row(2) *= -1;
  EXPECT_NEAR(fitted(placement, points, mirrored).rotation.toRotationMatrix().determinant(), 1,
              1e-12);
}

TEST(StartingGrid, BadOptionsAreNamed) {
  const auto field_of = [](const StartingGridOptions& options) -> std::string {
    try {
      options.validate();
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(field_of({.columns = 2}), "columns");
  EXPECT_EQ(field_of({.rows = 2}), "rows");
  EXPECT_EQ(field_of({.columns = 60, .rows = 60}), "columns");
  EXPECT_EQ(field_of({.columns = 3, .rows = 1'000'000'000}), "rows");
  EXPECT_EQ(field_of({.columns = 50, .rows = 50}), "none");
  EXPECT_EQ(field_of({.flat_angle = 0}), "flat_angle");
  EXPECT_EQ(field_of({.margin = 0.5}), "margin");
  EXPECT_EQ(field_of({.drive = -1}), "drive");
  EXPECT_EQ(field_of({.drive = std::nan("")}), "drive");
  EXPECT_EQ(field_of({.section = Rectangle{0, 1}}), "section.width");
  EXPECT_EQ(field_of({}), "none");
}

TEST(StartingGrid, TellsHowNearItsRodsLie) {
  const SurfaceMesh flat = field(8, [](double, double) { return 0.0; });
  StartingGridOptions options{.columns = 5, .rows = 9};
  options.margin = 0;
  for (const double angle : {std::numbers::pi / 2, 0.5}) {
    options.flat_angle = angle;
    const StartingGrid grid = starting_grid(flat, options);
    // Cells of 50 x 25, sheared.
    EXPECT_NEAR(grid.columns_apart, 50 * std::sin(angle), 0.5) << angle;
    EXPECT_NEAR(grid.rows_apart, 25 * std::sin(angle), 0.5) << angle;
  }
}

}  // namespace
}  // namespace limber::rods
