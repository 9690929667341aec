// Designs through the service: jobs, streams, and who may do what meanwhile.

#include <gtest/gtest.h>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerDesign : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};
  Subscriber subscriber{server->stream_endpoint()};

  void SetUp() override {
    proto::Scene scene;
    auto& linkage = *scene.mutable_linkage();
    linkage.mutable_lines()->set_sample("dome");
    linkage.mutable_section()->mutable_rectangle()->set_width(0.02);
    linkage.mutable_section()->mutable_rectangle()->set_height(0.005);
    linkage.set_edges_per_segment(4);
    ASSERT_TRUE(client.call(open_request(scene, "s")).has_open_session());
    ASSERT_TRUE(client.call(wait_request("s", 0)).has_wait());
  }

  /// One joint, up by a little.
  static proto::Request start_request(int iterations) {
    proto::Request request;
    auto& start = *request.mutable_start_design();
    start.set_session("s");
    start.set_flat_height(0.2);
    start.set_max_iterations(static_cast<std::uint32_t>(iterations));
    auto& target = *start.mutable_goal()->add_targets();
    target.set_joint(40);
    target.mutable_position()->set_z(0.1);
    return request;
  }
  proto::DesignInfo design() {
    proto::Request request;
    request.mutable_get_design()->set_session("s");
    return client.call(request).get_design().design();
  }
  proto::JobStatus ended_job(std::uint64_t job) {
    proto::Request request;
    request.mutable_get_job()->set_job(job);
    request.mutable_get_job()->set_wait_s(50);
    return client.call(request).get_job().status();
  }
  /// The next message on the design's topic.
  std::optional<proto::DesignInfo> next_info() {
    while (const auto message = subscriber.receive()) {
      if (message->topic == "session/s/design") return message->content.design();
    }
    return std::nullopt;
  }
};

TEST_F(ServerDesign, IsAJobWithATopicOfItsOwn) {
  subscriber.subscribe("session/s/design");
  const auto started = client.call(start_request(4));
  ASSERT_TRUE(started.has_start_design()) << started.error().message();
  const auto job = started.start_design().job();
  std::optional<proto::DesignInfo> last;
  while ((last = next_info()) && last->state() != proto::DESIGN_STATE_ENDED)
    EXPECT_EQ(last->job(), job);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->iteration(), 4U);
  EXPECT_EQ(last->end(), proto::DESIGN_END_ITERATION_LIMIT);
  EXPECT_LT(last->best().objective(), last->start().objective());
  ASSERT_TRUE(last->has_taken_revision());
  const auto status = ended_job(job);
  EXPECT_EQ(status.kind(), "design");
  EXPECT_EQ(status.session(), "s");
  EXPECT_EQ(status.state(), proto::JOB_STATE_DONE);
  proto::Request scene;
  scene.mutable_get_session()->set_session("s");
  scene.mutable_get_session()->set_with_scene(true);
  const auto conditions = client.call(scene).get_session().scene().linkage().conditions();
  EXPECT_EQ(conditions.segment_lengths_size(), 144);
  // A late subscriber gets how it ended.
  Subscriber late{server->stream_endpoint()};
  late.subscribe("session/s/design");
  const auto welcome = late.receive();
  ASSERT_TRUE(welcome);
  EXPECT_EQ(welcome->content.design().state(), proto::DESIGN_STATE_ENDED);
}

TEST_F(ServerDesign, EveryRequestOfOneThatIsNotRunningIsRefused) {
  proto::Request pause, resume, stop, take, change;
  pause.mutable_pause_design()->set_session("s");
  resume.mutable_resume_design()->set_session("s");
  stop.mutable_stop_design()->set_session("s");
  take.mutable_take_design()->set_session("s");
  change.mutable_change_design()->set_session("s");
  for (const auto* request : {&pause, &resume, &stop, &take, &change}) {
    EXPECT_EQ(client.call(*request).error().code(), proto::ERROR_CODE_FAILED_PRECONDITION)
        << request->ShortDebugString();
  }
  EXPECT_FALSE(design().job());
}

TEST_F(ServerDesign, PausedItKeepsEditsOutAndTheTransportAnswers) {
  const auto started = client.call(start_request(100000));
  ASSERT_TRUE(started.has_start_design()) << started.error().message();
  proto::Request pause, stop, take;
  pause.mutable_pause_design()->set_session("s");
  ASSERT_TRUE(client.call(pause).has_pause_design());
  const auto edited = client.call([] {
    proto::Request request;
    request.mutable_edit()->set_session("s");
    request.mutable_edit()->add_edits()->mutable_set_mean_angle()->set_angle_degrees(30);
    return request;
  }());
  EXPECT_EQ(edited.error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_NE(edited.error().message().find("design"), std::string::npos);
  for (int i = 0; i < 500 && design().state() != proto::DESIGN_STATE_PAUSED; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(design().state(), proto::DESIGN_STATE_PAUSED);
  take.mutable_take_design()->set_session("s");
  take.mutable_take_design()->set_expected_revision(7);
  EXPECT_EQ(client.call(take).error().field(), "expected_revision");
  stop.mutable_stop_design()->set_session("s");
  ASSERT_TRUE(client.call(stop).has_stop_design());
  EXPECT_EQ(ended_job(started.start_design().job()).state(), proto::JOB_STATE_CANCELLED);
  take.mutable_take_design()->clear_expected_revision();
  EXPECT_EQ(client.call(take).take_design().revision(), 1U);
  EXPECT_EQ(client.call(wait_request("s", 1)).wait().result().revision(), 1U);
}

TEST_F(ServerDesign, ClosingTheSessionEndsTheJobOfAPausedOne) {
  const auto started = client.call(start_request(100000));
  proto::Request pause, close;
  pause.mutable_pause_design()->set_session("s");
  ASSERT_TRUE(client.call(pause).has_pause_design());
  close.mutable_close_session()->set_session("s");
  ASSERT_TRUE(client.call(close).has_close_session());
  EXPECT_EQ(ended_job(started.start_design().job()).state(), proto::JOB_STATE_CANCELLED);
}

}  // namespace
}  // namespace limber::server
