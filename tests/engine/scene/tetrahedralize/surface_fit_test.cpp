#include "engine/scene/tetrahedralize/surface_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "engine/base/error.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/scene/formats/surface_formats.h"
#include "tests/engine/scene/not_finite.h"
#include "tests/engine/scene/shared_data.h"
#include "tests/engine/scene/tetrahedralize/box_surface.h"

namespace limber::scene {
namespace {

using Eigen::Vector3d;
using testing::box;
using ::testing::HasSubstr;
using testing::kInfinity;

TriangleSurface together(const TriangleSurface& a, const TriangleSurface& b) {
  TriangleSurface both;
  both.vertices.resize(3, a.vertex_count() + b.vertex_count());
  both.vertices << a.vertices, b.vertices;
  both.triangles.resize(3, a.triangle_count() + b.triangle_count());
  both.triangles << a.triangles, b.triangles.array() + a.vertex_count();
  return both;
}

/// A cone with its tip at height 1.
TriangleSurface cone(double radius) {
  constexpr int kSides = 32;
  TriangleSurface surface;
  surface.vertices.resize(3, kSides + 2);
  surface.triangles.resize(3, 2 * kSides);
  surface.vertices.col(kSides) = Vector3d::UnitZ();
  surface.vertices.col(kSides + 1) = Vector3d::Zero();
  for (int i = 0; i < kSides; ++i) {
    const double turn = 2 * std::numbers::pi * i / kSides;
    surface.vertices.col(i) << radius * std::cos(turn), radius * std::sin(turn), 0;
    const int next = (i + 1) % kSides;
    surface.triangles.col(2 * i) << i, next, kSides;
    surface.triangles.col(2 * i + 1) << next, i, kSides + 1;
  }
  return surface;
}

TriangleSurface spot() { return read_surface_file(testing::shared_body("../surfaces/spot.obj")); }
bool spot_is_there() {
  return std::filesystem::exists(testing::shared_body("../surfaces/spot.obj"));
}

/// As `expect_sound` of tetrahedralize_test.cpp, and near: by an independent measurement, from
/// every vertex and the middle of every triangle of both surfaces.
void expect_sound_and_near(const Tetrahedralization& result, const TriangleSurface& surface,
                           double within) {
  const bodies::PreparedMesh prepared = bodies::prepare_mesh(result.mesh, {});
  EXPECT_EQ(prepared.piece_count, 1);
  EXPECT_TRUE(prepared.repairs.empty());
  EXPECT_TRUE(prepared.warnings.empty());
  const TriangleSurface boundary = lattice::boundary_of(result.mesh);
  const SurfaceCheck check = check_surface(boundary);
  EXPECT_TRUE(check.closed_manifold());
  EXPECT_TRUE(check.oriented());
  EXPECT_GT(result.quality.min_mean_ratio, 0.3);
  EXPECT_GT(result.quality.min_dihedral_deg, 10);
  EXPECT_LT(result.quality.max_dihedral_deg, 165);
  ASSERT_TRUE(result.fit.has_value());
  EXPECT_LE(result.fit->distance_share, within);
  EXPECT_EQ(result.fit->share_beyond, 0);
  EXPECT_NEAR(result.fit->mesh_volume, check.volume, 1e-9 * check.volume);
  const lattice::TriangleTree there(boundary), back(surface);
  const double allowed = within * back.bounds().diagonal().norm();
  const auto middle = [](const TriangleSurface& s, int t) -> Vector3d {
    return (s.vertices.col(s.triangles(0, t)) + s.vertices.col(s.triangles(1, t)) +
            s.vertices.col(s.triangles(2, t))) /
           3;
  };
  for (int v = 0; v < surface.vertex_count(); ++v)
    ASSERT_LE(there.distance(surface.vertices.col(v)), allowed) << "vertex " << v;
  for (int t = 0; t < surface.triangle_count(); ++t)
    ASSERT_LE(there.distance(middle(surface, t)), allowed) << "triangle " << t;
  for (int t = 0; t < boundary.triangle_count(); ++t)
    ASSERT_LE(back.distance(middle(boundary, t)), allowed) << "boundary triangle " << t;
}

Tetrahedralization fill(const TriangleSurface& surface, int tets, double within = 0.02) {
  TetrahedralizeOptions options;
  options.target_tets = tets;
  options.within = within;
  return tetrahedralize(surface, options);
}

/// The message of the refusal; empty where there is none.
std::string fit_refusal(const TriangleSurface& surface, int tets, double within = 0.02) {
  try {
    static_cast<void>(fill(surface, tets, within));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
    EXPECT_EQ(error.field(), "within");
    return error.what();
  }
  return {};
}

int number_after(const std::string& text, const std::string& words) {
  const auto place = text.find(words);
  return place == std::string::npos ? 0 : std::atoi(text.c_str() + place + words.size());
}

TEST(SurfaceFit, DistancesOfNestedBoxesAreThoseOfCornersAndFaces) {
  const TriangleSurface outer = box({0, 0, 0}, {1, 1, 1}),
                        inner = box({0.1, 0.1, 0.1}, {0.9, 0.9, 0.9});
  const lattice::TriangleTree outer_tree(outer), inner_tree(inner);
  const lattice::GapSearch search{kInfinity, 0.01, 1e-4};
  // From a corner of the outer box to that of the inner one, and from the inner faces straight out.
  const auto out = lattice::one_sided_distance(outer, &outer_tree, inner_tree, search, {});
  EXPECT_NEAR(out.bound, 0.1 * std::sqrt(3.0), 2e-4);
  EXPECT_LE(out.largest, 0.1 * std::sqrt(3.0) + 1e-12);
  EXPECT_GE(out.bound, 0.1 * std::sqrt(3.0) - 1e-12);
  const auto in = lattice::one_sided_distance(inner, &inner_tree, outer_tree, search, {});
  EXPECT_NEAR(in.bound, 0.1, 2e-4);
}

TEST(SurfaceFit, GapsAreFoundInsideOfLargeTriangles) {
  // A dent in the middle of a face: no vertex of the flat box is near it.
  const TriangleSurface flat = box({0, 0, 0}, {1, 1, 1});
  const TriangleSurface post = box({0.45, 0.45, 0.5}, {0.55, 0.55, 1.3});
  const lattice::TriangleTree flat_tree(flat), post_tree(post);
  const auto to_post =
      lattice::one_sided_distance(post, &post_tree, flat_tree, {0.25, 0.02, 1e-3}, {});
  EXPECT_NEAR(to_post.bound, 0.5, 0.01);  // its lower end is 0.45 to 0.5 from the nearest face
  for (const auto& gap : to_post.gaps) EXPECT_GT(gap.distance, 0.25);
  EXPECT_FALSE(to_post.gaps.empty());
}

TEST(SurfaceFit, WhatIsInsideOfOverlappingPartsDoesNotCount) {
  const TriangleSurface surface =
      closed_outward(together(box({0, 0, 0}, {2, 1, 1}), box({1, 0.2, 0.2}, {3, 0.8, 0.8})));
  const Tetrahedralization result = fill(surface, 8000);
  EXPECT_LE(result.fit->distance_share, 0.02);
  EXPECT_EQ(result.fit->share_beyond, 0);
}

TEST(SurfaceFit, LegsHornsAndEarsOfSpotAreKept) {
  if (!spot_is_there()) GTEST_SKIP() << "spot.obj is not there";
  for (const int tets : {5000, 20000}) {
    SCOPED_TRACE(tets);
    const Tetrahedralization result = fill(spot(), tets);
    expect_sound_and_near(result, spot(), 0.02);
    EXPECT_NEAR(result.mesh.tet_count(), tets, 0.1 * tets);
    EXPECT_NEAR(result.fit->mesh_volume / result.fit->surface_volume, 1, 0.04);
  }
}

TEST(SurfaceFit, WhereAnyDistanceIsAllowedItIsReported) {
  if (!spot_is_there()) GTEST_SKIP() << "spot.obj is not there";
  const Tetrahedralization result = fill(spot(), 5000, 1);
  EXPECT_GT(result.fit->distance_share, 0.04);  // one cell size loses horns and ears
  EXPECT_NEAR(result.mesh.tet_count(), 5000, 500);
}

TEST(SurfaceFit, ATinyTargetIsRefusedWithANumberThatWorks) {
  const TriangleSurface surface = closed_outward(cone(0.2));
  const std::string text = fit_refusal(surface, 50);
  EXPECT_THAT(text, HasSubstr("50 tets come within"));
  const int needed = number_after(text, "About ");
  ASSERT_GT(needed, 500) << text;
  const Tetrahedralization result = fill(surface, needed);
  expect_sound_and_near(result, surface, 0.02);
  EXPECT_LE(result.mesh.tet_count(), 1.1 * needed);
}

TEST(SurfaceFit, AThinPlateIsKeptOrRefusedWithANumberThatWorks) {
  const TriangleSurface plate = box({0, 0, 0}, {1, 1, 0.05});
  const int needed = number_after(fit_refusal(plate, 300), "About ");
  ASSERT_GT(needed, 300);
  const Tetrahedralization result = fill(plate, needed);
  expect_sound_and_near(result, closed_outward(plate), 0.02);
  EXPECT_LE(result.mesh.tet_count(), 1.1 * needed);
}

TEST(SurfaceFit, TwoCloseSheetsDoNotMerge) {
  // A clip: two sheets of 0.12, 0.1 apart, joined at one end.
  const TriangleSurface clip = closed_outward(
      together(together(box({0, 0, 0}, {1, 0.6, 0.12}), box({0, 0, 0.22}, {1, 0.6, 0.34})),
               box({-0.02, 0.01, 0.01}, {0.15, 0.59, 0.33})));
  const Tetrahedralization result = fill(clip, 20000);
  expect_sound_and_near(result, clip, 0.03);
  // The gap between the sheets is empty.
  const double exact = 2 * 0.12 * 0.6 + 0.15 * 0.58 * 0.1 + 0.02 * 0.58 * 0.32 - 0.02 * 0.58 * 0.1;
  EXPECT_NEAR(result.fit->mesh_volume, exact, 0.05 * exact);
}

TEST(SurfaceFit, ASharpConeKeepsItsTip) {
  const TriangleSurface surface = closed_outward(cone(0.2));
  const Tetrahedralization result = fill(surface, 5000);
  expect_sound_and_near(result, surface, 0.02);
  EXPECT_GT(result.mesh.nodes.row(2).maxCoeff(), 1 - 0.022);
}

TEST(SurfaceFit, UnitsOfMillionthsAndMillionsGiveTheSameMesh) {
  const Tetrahedralization one = fill(cone(0.2), 5000);
  for (const double unit : {1e-6, 1e6}) {
    TriangleSurface scaled = cone(0.2);
    scaled.vertices *= unit;
    const Tetrahedralization result = fill(scaled, 5000);
    expect_sound_and_near(result, closed_outward(scaled), 0.02);
    EXPECT_NEAR(result.mesh.tet_count(), one.mesh.tet_count(), 0.2 * one.mesh.tet_count());
    EXPECT_NEAR(result.fit->mesh_volume / std::pow(unit, 3), one.fit->mesh_volume,
                0.02 * one.fit->mesh_volume);
  }
}

TEST(SurfaceFit, SeparatePartsAreRefusedWithoutANumber) {
  const TriangleSurface two = together(box({0, 0, 0}, {1, 1, 1}), box({2, 0, 0}, {2.3, 0.3, 0.3}));
  EXPECT_THAT(fit_refusal(two, 3000), HasSubstr("separate parts"));
  EXPECT_EQ(fill(two, 3000, 1).fit->within, 1);  // allowed: the largest is filled
}

TEST(SurfaceFit, RerunsAreEqual) {
  const Tetrahedralization a = fill(cone(0.2), 5000), b = fill(cone(0.2), 5000);
  EXPECT_EQ(a.mesh.nodes, b.mesh.nodes);
  EXPECT_EQ(a.mesh.tets, b.mesh.tets);
}

TEST(SurfaceFit, SplittingCellsCanBeCancelledAndReportsProgress) {
  JobContext job;
  double last = -1;
  bool is_splitting = false;
  job.progress = [&](const std::string& stage, double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1);
    last = fraction;
    is_splitting = stage == "splitting cells";
    if (is_splitting && fraction > 0.52) job.cancellation.request();
  };
  TetrahedralizeOptions options;
  options.target_tets = 3000;
  try {
    static_cast<void>(tetrahedralize(cone(0.1), options, job));
    FAIL() << "was not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
  EXPECT_TRUE(is_splitting);
}

TEST(SurfaceFit, WithinOutsideOfItsRangeIsRefused) {
  for (const double within : {0.0, -0.1, 1.5, std::nan("")}) {
    TetrahedralizeOptions options;
    options.within = within;
    EXPECT_THROW(options.validate(), Error) << within;
  }
}

}  // namespace
}  // namespace limber::scene
