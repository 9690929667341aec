// Designs of linkages with a real limberd.

#include "clients/cpp/linkages/design.h"

#include <gtest/gtest.h>

#include <sstream>
#include <thread>

#include "clients/cpp/linkages/on_surface.h"
#include "clients/cpp/linkages/session.h"
#include "tests/server/process/child_process.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {
namespace {

class DesignClient : public ::testing::Test {
 protected:
  DesignClient() {
    v1::GetSampleRequest sample;
    sample.set_name("dome");
    v1::Scene scene = client.call(sample).scene();
    scene.mutable_linkage()->set_edges_per_segment(4);
    linkage.emplace(LinkageSession::open(client, scene, "d"));
  }
  /// Joints where they are, a fifth farther up or down.
  v1::StartDesignRequest request() {
    v1::StartDesignRequest request;
    request.set_flat_height(0.2);
    const LinkageShape shape = linkage->shape();
    for (std::size_t j = 0; j < shape.joints.size(); ++j) {
      auto& target = *request.mutable_goal()->add_targets();
      target.set_joint(static_cast<std::uint32_t>(j));
      target.mutable_position()->set_x(shape.joints[j][0]);
      target.mutable_position()->set_y(shape.joints[j][1]);
      target.mutable_position()->set_z(1.2 * shape.joints[j][2]);
    }
    return request;
  }
  limber::TemporaryFolder folder;
  server::testing::Daemon daemon{folder.path()};
  Client client{daemon.requests};
  std::optional<LinkageSession> linkage;
};

TEST_F(DesignClient, RunsToItsEndAndUndoTakesItBack) {
  LinkageDesign design(client, linkage->id());
  EXPECT_FALSE(design.info());
  EXPECT_THROW((void)design.wait(), ClientError);
  v1::StartDesignRequest wanted = request();
  wanted.set_max_iterations(5);
  const std::uint64_t job = design.start(wanted);
  const v1::DesignInfo info = design.wait();
  EXPECT_EQ(info.job(), job);
  EXPECT_EQ(info.iteration(), 5U);
  EXPECT_LT(info.best().objective(), info.start().objective());
  ASSERT_EQ(info.taken_revision(), 1U);
  EXPECT_EQ(linkage->conditions().segment_lengths_size(), 144);
  const std::vector<double> best = design.best_lengths();
  ASSERT_EQ(best.size(), 144U);
  EXPECT_EQ(best[7], linkage->conditions().segment_lengths(7));
  linkage->undo();
  EXPECT_EQ(linkage->conditions().segment_lengths_size(), 0);
}

TEST_F(DesignClient, IsPausedChangedStoppedAndTaken) {
  LinkageDesign design(client, linkage->id());
  v1::StartDesignRequest wanted = request();
  wanted.set_max_iterations(100000);
  design.start(wanted);
  design.pause();
  while (design.info()->state() != v1::DESIGN_STATE_PAUSED)
    std::this_thread::sleep_for(Milliseconds{5});
  v1::ChangeDesignRequest change;
  change.set_distance_weight(123);
  design.change(change);
  while (design.info()->distance_weight() != 123) std::this_thread::sleep_for(Milliseconds{5});
  change.set_distance_weight(-1);
  EXPECT_THROW(design.change(change), ClientError);
  EXPECT_EQ(design.info()->distance_weight(), 123);
  design.resume();
  design.pause();
  design.stop();
  const v1::DesignInfo info = design.info().value();
  EXPECT_EQ(info.end(), v1::DESIGN_END_STOPPED);
  EXPECT_FALSE(info.has_taken_revision());
  EXPECT_EQ(design.take(0), 1U);
  EXPECT_EQ(linkage->conditions().segment_lengths_size(), 144);
}

/// z = h (1 - x^2 - y^2) as an .obj.
v1::MeshFile hill(double height) {
  constexpr int kLines = 12;
  std::ostringstream text;
  for (int r = 0; r < kLines; ++r) {
    for (int c = 0; c < kLines; ++c) {
      const double x = 2.0 * c / (kLines - 1) - 1, y = 2.0 * r / (kLines - 1) - 1;
      text << "v " << x << ' ' << y << ' ' << height * (1 - x * x - y * y) << '\n';
    }
  }
  const auto vertex = [](int c, int r) { return r * kLines + c + 1; };
  for (int r = 0; r + 1 < kLines; ++r) {
    for (int c = 0; c + 1 < kLines; ++c) {
      const int first = vertex(c, r), last = vertex(c + 1, r + 1);
      text << "f " << first << ' ' << vertex(c + 1, r) << ' ' << last << '\n';
      text << "f " << first << ' ' << last << ' ' << vertex(c, r + 1) << '\n';
    }
  }
  v1::MeshFile file;
  file.set_name("hill.obj");
  file.set_content(text.str());
  return file;
}

TEST_F(DesignClient, BeginsWithASurfaceAlone) {
  v1::MakeStartingGridRequest grid;
  *grid.mutable_surface()->mutable_file() = hill(-0.2);
  grid.set_columns(5);
  grid.set_rows(6);
  v1::Scene rods;
  rods.mutable_linkage()->mutable_section()->mutable_rectangle()->set_width(0.02);
  rods.mutable_linkage()->mutable_section()->mutable_rectangle()->set_height(0.004);
  rods.mutable_linkage()->set_edges_per_segment(5);
  SurfaceLinkage opened = open_on_surface(client, grid, rods, "bowl");
  EXPECT_EQ(opened.session.id(), "bowl");
  EXPECT_GT(opened.misfit, 0);
  EXPECT_EQ(opened.session.shape().joints.size(), 30U);
  // A bowl: its middle, which is held, lies below its corners.
  const LinkageShape shape = opened.session.shape();
  EXPECT_GT(shape.joints[0][2], shape.joints[17][2]);
  opened.design.set_max_iterations(100);
  LinkageDesign design(client, "bowl");
  (void)design.start(opened.design);
  const v1::DesignInfo info = design.wait();
  EXPECT_LT(info.best().surface_rms(), 0.5 * info.start().surface_rms());
  EXPECT_TRUE(info.has_placement());
  grid.set_columns(1);
  EXPECT_THROW((void)open_on_surface(client, grid, rods), ClientError);
}

}  // namespace
}  // namespace limber::client
