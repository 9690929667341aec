// Sessions of rod linkages with a real limberd, and shapes of messages that no server sends.

#include "clients/cpp/linkages/session.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/clients/refusal.h"
#include "tests/server/process/child_process.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {
namespace {

using testing::StartsWith;

v1::Scene sample(Client& client, const std::string& name) {
  v1::GetSampleRequest request;
  request.set_name(name);
  return client.call(request).scene();
}

Vector at(const Point& point, const Vector& shift = {0, 0, 0}) {
  return {point[0] + shift[0], point[1] + shift[1], point[2] + shift[2]};
}

double distance(const Point& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

unsigned highest(const LinkageShape& shape) {
  const auto top = std::max_element(shape.joints.begin(), shape.joints.end(),
                                    [](const Point& a, const Point& b) { return a[2] < b[2]; });
  return static_cast<unsigned>(top - shape.joints.begin());
}

class LinkageClient : public ::testing::Test {
 protected:
  LinkageSession hyperboloid() {
    return LinkageSession::open(client, sample(client, "hyperboloid"), "h");
  }
  limber::TemporaryFolder folder;
  server::testing::Daemon daemon{folder.path()};
  Client client{daemon.requests};
};

TEST_F(LinkageClient, DeploysStepByStepAndPullsAJoint) {
  LinkageSession linkage = hyperboloid();
  EXPECT_EQ(linkage.id(), "h");
  linkage.deploy(50);
  const v1::ResultInfo deployed = linkage.wait();
  EXPECT_EQ(deployed.status(), v1::SOLVE_STATUS_CONVERGED) << deployed.message();
  EXPECT_NEAR(deployed.linkage().mean_angle_degrees(), 50, 1e-6);
  EXPECT_GT(deployed.linkage().path_size(), 10);
  EXPECT_NEAR(deployed.linkage().path().rbegin()->mean_angle_degrees(), 50, 1e-6);
  EXPECT_TRUE(events(deployed).empty());

  const std::vector<LinkageShape> shapes = linkage.shapes();
  ASSERT_EQ(static_cast<int>(shapes.size()), deployed.linkage().path_size());
  const LinkageShape& shape = shapes.back();
  double mean = 0;
  for (const double angle : shape.angles) mean += angle / static_cast<double>(shape.angles.size());
  EXPECT_NEAR(mean, 50, 1e-4);
  const LinkageGeometry& geometry = linkage.geometry();
  ASSERT_EQ(geometry.segments(), 144);
  ASSERT_EQ(geometry.joints(), 84);
  EXPECT_EQ(geometry.rods().size(), 24U);
  for (const LinkageRod& rod : geometry.rods()) EXPECT_EQ(rod.segments.size(), 6U);
  EXPECT_FALSE(geometry.mixed_angles());
  for (int s = 0; s < geometry.segments(); ++s) {
    EXPECT_EQ(shape.centrelines[s].size(), shape.directors[s].size() + 1);
    EXPECT_EQ(static_cast<int>(shape.directors[s].size()), geometry.edges()[s]);
    for (const Point& director : shape.directors[s])
      EXPECT_NEAR(std::hypot(director[0], director[1], director[2]), 1, 1e-5);
  }

  const unsigned top = highest(shape);
  const Vector higher = at(shape.joints[top], {0, 0, 0.1});
  const std::uint64_t target = linkage.attach(top, higher, 1e6);
  const v1::ResultInfo pulled = linkage.wait();
  EXPECT_EQ(pulled.revision(), 2U);
  EXPECT_LT(distance(linkage.shape().joints[top], higher), 1e-3);
  const Vector lower = at(shape.joints[top], {0, 0, 0.05});
  linkage.move_target(target, lower);
  linkage.wait();
  EXPECT_LT(distance(linkage.shape().joints[top], lower), 1e-3);
  ASSERT_EQ(linkage.conditions().targets_size(), 1);
  EXPECT_EQ(linkage.conditions().targets(0).id(), target);
  linkage.remove_target(target);
  EXPECT_NEAR(linkage.wait().total_energy(), deployed.total_energy(),
              1e-6 * deployed.total_energy());
  linkage.close();
  EXPECT_EQ(refusal([&] { linkage.status(); }).code(), v1::ERROR_CODE_NOT_FOUND);
}

TEST_F(LinkageClient, PinsLoadsAndAnglesActAndUndoTakesThemBack) {
  LinkageSession linkage = hyperboloid();
  linkage.deploy(40);
  const v1::ResultInfo before = linkage.wait();
  const LinkageShape shape = linkage.shape();
  const unsigned top = highest(shape), other = top == 0 ? 1 : 0;
  linkage.pin(other, v1::HELD_MOTION);
  linkage.load(top, {{0, 0, -20}, {0, 0, 0}, 0});
  const v1::ResultInfo loaded = linkage.wait();
  EXPECT_FALSE(loaded.solve_failed()) << loaded.message();
  EXPECT_LT(linkage.shape().joints[top][2], shape.joints[top][2] - 1e-4);
  EXPECT_LT(distance(linkage.shape().joints[other], at(shape.joints[other])), 1e-5);
  linkage.load(top, {});
  linkage.gravity({0, 0, -9.81});
  const v1::ResultInfo heavy = linkage.wait();
  EXPECT_FALSE(heavy.solve_failed()) << heavy.message();
  EXPECT_NE(heavy.linkage().load_potential(), before.linkage().load_potential());
  ASSERT_EQ(linkage.conditions().loads_size(), 0);
  EXPECT_EQ(linkage.conditions().gravity().z(), -9.81);
  linkage.undo();
  EXPECT_EQ(linkage.conditions().gravity().z(), 0);
  linkage.redo();
  EXPECT_EQ(linkage.conditions().gravity().z(), -9.81);
  linkage.gravity({0, 0, 0});
  linkage.release(other);
  EXPECT_EQ(linkage.conditions().pins_size(), 0);
}

TEST_F(LinkageClient, AnglesAndPlacesOfJointsAreReached) {
  LinkageSession linkage = hyperboloid();
  const LinkageShape shape = linkage.shape();
  const unsigned top = highest(shape);
  linkage.deploy(std::nullopt);
  linkage.set_angle(top, 45);
  const v1::ResultInfo opened = linkage.wait();
  EXPECT_FALSE(opened.solve_failed()) << opened.message();
  EXPECT_NEAR(linkage.shape().angles[top], 45, 1e-4);
  linkage.set_angle(top, std::nullopt);
  EXPECT_EQ(linkage.conditions().angles_size(), 0);
  const Vector pulled = at(shape.joints[top], {0.05, 0, 0});
  linkage.pin(top, v1::HELD_MOTION_AND_ANGLE, pulled);
  const v1::ResultInfo pinned = linkage.wait();
  EXPECT_FALSE(pinned.solve_failed()) << pinned.message();
  EXPECT_LT(distance(linkage.shape().joints[top], pulled), 1e-4);
}

TEST_F(LinkageClient, ASecondClientSeesTheSameAndPullsOnASegment) {
  LinkageSession linkage = hyperboloid();
  Client another(daemon.requests);
  LinkageSession same(another, "h");
  const LinkageShape shape = same.shape();
  const Point middle = shape.centrelines[7][shape.centrelines[7].size() / 2];
  const Vector wanted = at(middle, {0, 0, 0.02});
  same.attach_segment(7, 0.5, wanted, 1e7);
  same.wait();
  linkage.status();
  EXPECT_EQ(linkage.revision(), 1U);
  const auto line = linkage.shape().centrelines[7];
  EXPECT_LT(distance(line[line.size() / 2], wanted), 5e-3);
  const Positions surface = linkage.positions();
  EXPECT_EQ(surface.values.size(), surface.frames * surface.nodes * 3);
  EXPECT_GT(surface.nodes, 0U);
}

TEST_F(LinkageClient, RefusalsNameTheirFieldAndFailedBuildsLeaveNothing) {
  LinkageSession linkage = hyperboloid();
  const ClientError far = refusal([&] { linkage.pin(84); });
  EXPECT_EQ(far.code(), v1::ERROR_CODE_OUT_OF_RANGE);
  EXPECT_EQ(far.field(), "edits[0].pin_joint.pin.joint");
  EXPECT_EQ(refusal([&] { linkage.deploy(180); }).field(), "edits[0].set_mean_angle.angle_degrees");
  EXPECT_EQ(refusal([&] { linkage.move_target(7, {0, 0, 0}); }).code(), v1::ERROR_CODE_NOT_FOUND);
  v1::Scene bad = sample(client, "grid");
  bad.mutable_linkage()->mutable_section()->mutable_rectangle()->set_width(-1);
  EXPECT_THAT(refusal([&] { LinkageSession::open(client, bad); }).field(),
              StartsWith("scene.linkage.section"));
  // A build that takes longer than its caller waits is closed again.
  EXPECT_EQ(refusal([&] {
              LinkageSession::open(client, sample(client, "dome"), "d", Milliseconds{0});
            }).code(),
            v1::ERROR_CODE_TIMEOUT);
  EXPECT_EQ(client.call(v1::ListSessionsRequest{}).sessions_size(), 1);
}

TEST_F(LinkageClient, LengthsOfLeastStressComeWithTheScene) {
  v1::Scene scene = sample(client, "dome");
  const double drawn = [&] {
    LinkageSession linkage = LinkageSession::open(client, scene);
    return linkage.wait().linkage().bending_energy();
  }();
  scene.mutable_linkage()->set_rest_lengths(v1::REST_LENGTHS_LEAST_STRESS);
  scene.mutable_linkage()->set_bending(v1::ROD_BENDING_TURNING_ANGLE);
  LinkageSession linkage = LinkageSession::open(client, scene, "relaxed");
  const v1::ResultInfo result = linkage.wait();
  EXPECT_EQ(result.status(), v1::SOLVE_STATUS_CONVERGED) << result.message();
  EXPECT_LT(result.linkage().bending_energy(), drawn);
}

/// One segment of two edges between joint 0 and a free end.
v1::GetGeometryResponse small_geometry() {
  v1::GetGeometryResponse message;
  auto& linkage = *message.mutable_linkage();
  linkage.set_coordinates(6 * 2 + 3 + 1);
  linkage.add_edges(2);
  linkage.add_vertex_of_joint(5);
  auto& ends = *linkage.mutable_joints_of_segment();
  ends.set_type(v1::DATA_TYPE_INT32);
  ends.add_shape(1);
  ends.add_shape(2);
  const std::int32_t joints[] = {0, -1};
  ends.set_data(joints, sizeof joints);
  v1::LinkageRod& rod = *linkage.add_rods();
  rod.add_segments(0);
  rod.add_reversed(true);
  rod.set_closed(true);
  return message;
}

v1::Frames frames_of(const std::vector<float>& numbers, std::uint64_t columns) {
  v1::Frames frames;
  frames.set_encoding(v1::ENCODING_COORDINATES);
  frames.mutable_data()->set_type(v1::DATA_TYPE_FLOAT32);
  frames.mutable_data()->add_shape(numbers.size() / columns);
  frames.mutable_data()->add_shape(columns);
  frames.mutable_data()->set_data(numbers.data(), numbers.size() * sizeof(float));
  return frames;
}

TEST(LinkageGeometry, PartsOfAShapeComeInTheirOrder) {
  const LinkageGeometry geometry(small_geometry());
  EXPECT_EQ(geometry.vertex_of_joint(), std::vector<int>{5});
  EXPECT_EQ(geometry.joints_of_segment(), (std::vector<std::array<int, 2>>{{0, -1}}));
  ASSERT_EQ(geometry.rods().size(), 1U);
  EXPECT_EQ(geometry.rods()[0].segments, std::vector<int>{0});
  EXPECT_EQ(geometry.rods()[0].reversed, std::vector<bool>{true});
  EXPECT_TRUE(geometry.rods()[0].closed);
  std::vector<float> numbers{0, 0, 0, 2, 0, 0, 4, 1, 0, 0, 1, 0, 0, 0, 1, 3.14159265F / 2};
  const auto shapes = geometry.shapes(frames_of(numbers, 16));
  ASSERT_EQ(shapes.size(), 1U);
  EXPECT_EQ(shapes[0].centrelines[0], (std::vector<Point>{{0, 0, 0}, {2, 0, 0}, {4, 1, 0}}));
  EXPECT_EQ(shapes[0].directors[0], (std::vector<Point>{{0, 1, 0}, {0, 0, 1}}));
  EXPECT_EQ(shapes[0].joints[0], (Point{1, 0, 0}));
  EXPECT_NEAR(shapes[0].angles[0], 90, 1e-5);
}

TEST(LinkageGeometry, WhatDoesNotFitIsMalformed) {
  const auto code = [](const auto& call) { return refusal(call).code(); };
  const LinkageGeometry geometry(small_geometry());
  const std::vector<float> numbers(30, 0.0F);
  EXPECT_EQ(code([&] { (void)geometry.shapes(frames_of(numbers, 15)); }), v1::ERROR_CODE_MALFORMED);
  v1::Frames positions = frames_of(std::vector<float>(16), 16);
  positions.set_encoding(v1::ENCODING_POSITIONS);
  EXPECT_EQ(code([&] { (void)geometry.shapes(positions); }), v1::ERROR_CODE_MALFORMED);
  const auto spoiled = [&](const auto& spoil) {
    v1::GetGeometryResponse message = small_geometry();
    spoil(*message.mutable_linkage());
    return code([&] { const LinkageGeometry bad(message); });
  };
  EXPECT_EQ(spoiled([](auto& l) { l.set_coordinates(17); }), v1::ERROR_CODE_MALFORMED);
  EXPECT_EQ(spoiled([](auto& l) { l.add_edges(2); }), v1::ERROR_CODE_MALFORMED);
  EXPECT_EQ(spoiled([](auto& l) { l.mutable_rods(0)->set_segments(0, 1); }),
            v1::ERROR_CODE_MALFORMED);
  EXPECT_EQ(spoiled([](auto& l) { l.mutable_rods(0)->clear_reversed(); }),
            v1::ERROR_CODE_MALFORMED);
  EXPECT_EQ(spoiled([](auto& l) { l.clear_vertex_of_joint(); }), v1::ERROR_CODE_MALFORMED);
  EXPECT_EQ(spoiled([](auto& l) { l.set_edges(0, 4000000000U); }), v1::ERROR_CODE_MALFORMED);
  EXPECT_EQ(code([] { const LinkageGeometry none(v1::GetGeometryResponse{}); }),
            v1::ERROR_CODE_FAILED_PRECONDITION);
}

}  // namespace
}  // namespace limber::client
