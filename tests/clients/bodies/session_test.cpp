// Sessions of elastic bodies with a real limberd.

#include "clients/cpp/bodies/session.h"

#include <gmock/gmock.h>

#include <array>
#include <cstring>

#include "tests/clients/refusal.h"
#include "tests/server/process/child_process.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {
namespace {

constexpr unsigned kCells = 6;                 // of a bar along x, 1 m each
constexpr unsigned kNodes = 4 * (kCells + 1);  // four in each section
constexpr unsigned kTip = kNodes - 1;
constexpr unsigned kFrames = 40;

template <class Number>
v1::Array rows(v1::DataType type, const std::vector<Number>& values, std::uint64_t width) {
  v1::Array array;
  array.set_type(type);
  array.add_shape(values.size() / width);
  array.add_shape(width);
  array.mutable_data()->resize(values.size() * sizeof(Number));
  std::memcpy(array.mutable_data()->data(), values.data(), array.data().size());
  return array;
}

std::vector<double> bar_nodes() {
  std::vector<double> nodes;
  for (unsigned i = 0; i <= kCells; ++i)
    for (const auto& [y, z] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}})
      nodes.insert(nodes.end(),
                   {static_cast<double>(i), static_cast<double>(y), static_cast<double>(z)});
  return nodes;
}

/// Held at x = 0. Each cell is six tets around its diagonal.
v1::Scene bar() {
  constexpr std::array<std::array<int, 2>, 6> kAround{
      {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}}};
  std::vector<std::int32_t> tets;
  for (int i = 0; i < static_cast<int>(kCells); ++i) {
    const auto corner = [i](int bits) { return 4 * (i + (bits & 1)) + (bits >> 1); };
    for (const auto& [a, b] : kAround)
      tets.insert(tets.end(), {corner(0), corner(a), corner(b), corner(7)});
  }
  v1::Scene scene;
  *scene.mutable_mesh()->mutable_arrays()->mutable_nodes() =
      rows(v1::DATA_TYPE_FLOAT64, bar_nodes(), 3);
  *scene.mutable_mesh()->mutable_arrays()->mutable_tets() = rows(v1::DATA_TYPE_INT32, tets, 4);
  for (unsigned node = 0; node < 4; ++node) scene.add_fixed_nodes(node);
  scene.set_frames(kFrames);
  scene.mutable_material()->set_youngs_modulus(1e5);
  scene.mutable_dynamics()->set_period_frames(25);
  scene.mutable_model()->set_modes(6);
  scene.mutable_model()->set_tolerance(0.1);
  return scene;
}

v1::Constraint lifted_tip(double height) {
  v1::Constraint constraint;
  constraint.set_frame(20);
  constraint.add_nodes(kTip);
  constraint.mutable_displacement()->set_z(height);
  constraint.set_exact(true);
  return constraint;
}

struct BodyClient : ::testing::Test {
  const limber::TemporaryFolder folder;
  const server::testing::Daemon daemon{folder.path()};
  Client client{daemon.requests};
  BodySession body = BodySession::open(client, bar(), "bar");

  v1::Scene scene() {
    v1::GetSessionRequest request;
    request.set_session("bar");
    request.set_with_scene(true);
    return client.call(request).scene();
  }
  /// Of the tip above where it is drawn, in frame 20.
  double height() {
    const Positions positions = body.positions();
    EXPECT_EQ(positions.frames, kFrames);
    EXPECT_EQ(positions.nodes, kNodes);
    return positions.values[(20 * kNodes + kTip) * 3 + 2] - 1;
  }
};

TEST_F(BodyClient, ConstraintsAreAddedMovedReplacedAndRemoved) {
  const v1::EditResponse added = body.add(lifted_tip(0.3));
  ASSERT_EQ(added.constraint_ids_size(), 1);
  const std::uint64_t id = added.constraint_ids(0);
  EXPECT_EQ(body.wait().revision(), 1U);
  EXPECT_NEAR(height(), 0.3, 1e-3);
  body.move(id, {0, 0, -0.2});
  EXPECT_TRUE(body.wait_checked().has_motion_error());
  EXPECT_NEAR(height(), -0.2, 1e-3);
  v1::Constraint other = lifted_tip(0.1);
  other.set_id(id);
  body.replace(other);
  body.wait();
  EXPECT_NEAR(height(), 0.1, 1e-3);
  ASSERT_EQ(body.constraints().size(), 1U);
  EXPECT_EQ(body.constraints()[0].id(), id);
  v1::Constraint late = lifted_tip(0);
  late.set_frame(30);
  const std::uint64_t second = body.add(late).constraint_ids(0);
  EXPECT_EQ(body.remove({id, second}).revision(), 5U) << "one revision";
  EXPECT_TRUE(body.constraints().empty());
  EXPECT_EQ(body.undo().revision(), 6U);
  EXPECT_EQ(body.constraints().size(), 2U);
  EXPECT_EQ(body.redo().revision(), 7U);
}

TEST_F(BodyClient, PointsOfTheSurfaceArePickedAndHeld) {
  const Vector middle_of_end{kCells, 0.5, 0.3};
  const PickedPoint picked = body.nearest_surface_point({kCells + 2.0, 0.5, 0.3});
  EXPECT_EQ(picked.point.surface(), v1::POINT_SURFACE_MESH);
  EXPECT_NEAR(picked.distance, 2, 1e-6);
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(picked.position[axis], middle_of_end[axis], 1e-6);
  v1::Constraint constraint;
  constraint.set_frame(20);
  *constraint.mutable_point() = picked.point;
  constraint.mutable_displacement()->set_z(0.4);
  constraint.set_exact(true);
  body.add(constraint);
  body.wait();
  EXPECT_EQ(body.constraints().at(0).point().DebugString(), picked.point.DebugString());
  // Where it is shown now.
  const DrawnSurface shown = body.surface(20);
  double x = 0, y = 0, z = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double weight = picked.point.weights(static_cast<int>(k));
    const auto vertex = static_cast<std::size_t>(shown.triangles[3 * picked.point.triangle() + k]);
    x += weight * shown.vertices[3 * vertex];
    y += weight * shown.vertices[3 * vertex + 1];
    z += weight * shown.vertices[3 * vertex + 2];
  }
  EXPECT_NEAR(x, kCells, 1e-5);
  EXPECT_NEAR(y, 0.5, 1e-5);
  EXPECT_NEAR(z, 0.7, 1e-5);
  EXPECT_EQ(body.nearest_surface_point({x, y, z}, 20).distance < 1e-5, true);
  EXPECT_EQ(refusal([&] { (void)body.surface({}, v1::POINT_SURFACE_CARRIED); }).field(), "surface");
}

TEST_F(BodyClient, NodesArePickedByABox) {
  EXPECT_THAT(body.nodes_in_box({kCells - 0.5, -1, 0.5}, {kCells + 1, 2, 2}),
              ::testing::ElementsAre(kTip - 1, kTip));
  EXPECT_THAT(body.nodes_in_box({10, 10, 10}, {11, 11, 11}), ::testing::IsEmpty());
}

TEST_F(BodyClient, DynamicsThatAreNotGivenStay) {
  DynamicsChange change;
  change.damping_ratio = 0.25;
  body.dynamics(change);
  EXPECT_EQ(scene().dynamics().damping_ratio(), 0.25);
  EXPECT_EQ(scene().dynamics().period_frames(), 25);
  body.ends(v1::END_CONDITION_FREE, v1::END_CONDITION_PINNED_POSITION);
  EXPECT_EQ(scene().first_end(), v1::END_CONDITION_FREE);
  EXPECT_EQ(scene().last_end(), v1::END_CONDITION_PINNED_POSITION);
  EXPECT_EQ(body.revision(), 2U);
  change = {};
  change.force_smoothing = 0.125;
  change.inertia = 2;
  body.dynamics(change);
  EXPECT_EQ(scene().dynamics().force_smoothing(), 0.125);
  EXPECT_EQ(scene().dynamics().inertia(), 2);
  EXPECT_EQ(scene().dynamics().damping_ratio(), 0.25);
  change = {};
  change.inertia = 0;
  change.discretisation = v1::TIME_DISCRETISATION_DIFFERENCES;
  body.dynamics(change);
  EXPECT_EQ(scene().dynamics().discretisation(), v1::TIME_DISCRETISATION_DIFFERENCES);
  body.undo();
  EXPECT_EQ(scene().dynamics().inertia(), 2);
}

TEST_F(BodyClient, KeyframesAreAddedMovedAndRemoved) {
  std::vector<double> pose = bar_nodes();
  for (std::size_t node = 0; node < kNodes; ++node)
    pose[3 * node + 2] += 0.01 * pose[3 * node] * pose[3 * node];
  v1::Keyframe keyframe;
  keyframe.set_frame(20);
  *keyframe.mutable_positions() = rows(v1::DATA_TYPE_FLOAT64, pose, 3);
  keyframe.set_exact(true);
  const v1::EditResponse added = body.add_keyframe(keyframe);
  ASSERT_EQ(added.keyframe_ids_size(), 1);
  const std::uint64_t id = added.keyframe_ids(0);
  body.wait();
  EXPECT_GT(height(), 0.2);
  KeyframeMove move;
  move.frame = 30;
  move.weight = 10;
  body.move_keyframe(id, move);
  ASSERT_EQ(body.keyframes().size(), 1U);
  EXPECT_EQ(body.keyframes()[0].frame(), 30U);
  EXPECT_EQ(body.keyframes()[0].weight(), 10);
  body.remove_keyframes({id});
  // The scene has no fixed nodes of so many paths: the field shows what was sent.
  v1::Array paths;
  paths.set_type(v1::DATA_TYPE_FLOAT64);
  for (const int extent : {1, 1, 3}) paths.add_shape(extent);
  paths.set_data(std::string(24, '\0'));
  try {
    body.move_pins(paths);
    ADD_FAILURE() << "was accepted";
  } catch (const ClientError& error) {
    EXPECT_THAT(error.field(), ::testing::StartsWith("edits[0].set_pins.pins"));
  }
  body.move_pins({});
  EXPECT_TRUE(body.keyframes().empty());
}

TEST_F(BodyClient, TheMaterialIsFittedFrozenAndForgotten) {
  body.add(lifted_tip(0.3));
  body.optimise(v1::MATERIAL_VARIABLES_DYNAMICS);
  body.wait();
  EXPECT_EQ(body.material().variables(), v1::MATERIAL_VARIABLES_DYNAMICS);
  EXPECT_EQ(body.material().modes_size(), 6);
  const std::uint64_t before = body.revision();
  EXPECT_EQ(body.optimise(v1::MATERIAL_VARIABLES_MOTION, FittedMaterial::kForgotten).revision(),
            before + 1);
  body.wait();
  const v1::GetMaterialResponse own = body.material();
  EXPECT_EQ(own.variables(), v1::MATERIAL_VARIABLES_MOTION);
  EXPECT_NEAR(own.modes(0).frequency_hz(), own.initial(0).frequency_hz(), 1e-9);
  EXPECT_EQ(body.reset_material().revision(), before + 2);
  EXPECT_GT(body.solve_cold(), 0U);
}

TEST_F(BodyClient, RefusalsNameTheEdit) {
  v1::Constraint late = lifted_tip(0.1);
  late.set_frame(kFrames);
  const ClientError error = refusal([&] { body.add(late); });
  EXPECT_EQ(error.code(), v1::ERROR_CODE_OUT_OF_RANGE);
  EXPECT_EQ(error.field(), "edits[0].add.constraint.frame");
  const ClientError stale = refusal([&] { body.edit({v1::Edit{}}, 7); });
  EXPECT_NE(stale.code(), v1::ERROR_CODE_UNSPECIFIED);
  EXPECT_EQ(body.close().ByteSizeLong(), 0U);
  EXPECT_THROW(body.status(), ClientError);
}

}  // namespace
}  // namespace limber::client
