#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/scene/formats/point_cache.h"
#include "server/wire/scene_json.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using ::testing::HasSubstr;

constexpr int kNodes = 28;  // of small_scene()

/// A bar that nothing holds and that falls: 20 frames at 30 frames a second.
proto::Scene falling_bar() {
  proto::Scene scene = small_scene();
  scene.clear_fixed_nodes();
  scene.clear_constraints();
  scene.mutable_simulation()->mutable_gravity()->set_y(-9.81);
  scene.mutable_simulation()->set_steps_per_frame(2);
  return scene;
}

struct ServerSimulations : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};

  proto::Reply simulate(const proto::Scene& scene) {
    proto::Request request;
    *request.mutable_simulate()->mutable_scene() = scene;
    return client.call(request);
  }
  std::uint64_t simulated(const proto::Scene& scene) {
    const auto reply = simulate(scene);
    EXPECT_TRUE(reply.has_simulate()) << reply.ShortDebugString();
    const auto job = client.call(job_request(reply.simulate().job(), 60)).get_job();
    EXPECT_EQ(job.status().state(), proto::JOB_STATE_DONE) << job.status().ShortDebugString();
    return reply.simulate().job();
  }
  proto::Reply frames(std::uint64_t job, std::uint32_t first = 0, std::uint32_t count = 0) {
    proto::Request request;
    request.mutable_get_frames()->set_job(job);
    request.mutable_get_frames()->set_first_frame(first);
    request.mutable_get_frames()->set_frame_count(count);
    return client.call(request);
  }
  proto::Reply exported(std::uint64_t job, proto::ExportFormat format) {
    proto::Request request;
    request.mutable_export_()->set_job(job);
    request.mutable_export_()->set_format(format);
    request.mutable_export_()->set_stem("fall");
    return client.call(request);
  }
};

Eigen::MatrixXf matrix_of(const proto::Frames& frames) {
  return Eigen::Map<const Eigen::MatrixXf>(
      reinterpret_cast<const float*>(frames.data().data().data()),
      static_cast<Eigen::Index>(3 * frames.data().shape(1)),
      static_cast<Eigen::Index>(frames.data().shape(0)));
}

TEST_F(ServerSimulations, AFreeBodyFallsByHalfGTSquared) {
  const std::uint64_t job = simulated(falling_bar());
  const auto reply = frames(job).get_frames().frames();
  EXPECT_EQ(reply.encoding(), proto::ENCODING_POSITIONS);
  const Eigen::MatrixXf positions = matrix_of(reply);
  ASSERT_EQ(positions.cols(), 20);
  ASSERT_EQ(positions.rows(), 3 * kNodes);
  // The midpoint rule is exact for it, at any step.
  for (int frame = 0; frame < 20; ++frame) {
    const double t = frame / 30.0;
    const Eigen::VectorXd u = (positions.col(frame) - positions.col(0)).cast<double>();
    for (int node = 0; node < kNodes; ++node) {
      EXPECT_NEAR(u[3 * node], 0, 2e-6);
      EXPECT_NEAR(u[3 * node + 1], -0.5 * 9.81 * t * t, 2e-6) << frame;
      EXPECT_NEAR(u[3 * node + 2], 0, 2e-6);
    }
  }
  const auto report = client.call(job_request(job, 0)).get_job().simulation();
  EXPECT_EQ(report.frames(), 20u);
  EXPECT_EQ(report.nodes(), static_cast<std::uint32_t>(kNodes));
  EXPECT_EQ(report.steps(), 38u);
  EXPECT_LT(report.energy_drift(), 1e-9);
  EXPECT_NEAR(report.work(19), report.kinetic_energy(19), 1e-9 * report.work(19));
}

TEST_F(ServerSimulations, FramesComeInPartsAndAreBounded) {
  const std::uint64_t job = simulated(falling_bar());
  const Eigen::MatrixXf all = matrix_of(frames(job).get_frames().frames());
  EXPECT_EQ(matrix_of(frames(job, 5, 3).get_frames().frames()), all.middleCols(5, 3));
  EXPECT_EQ(frames(job, 20).error().field(), "first_frame");
  EXPECT_EQ(frames(job, 5, 16).error().field(), "frame_count");
  proto::Request request;
  request.mutable_get_frames()->set_job(job);
  request.mutable_get_frames()->set_first_frame(2);
  request.mutable_get_frames()->set_most_bytes(3 * 12 * kNodes + 1);
  const auto part = client.call(request).get_frames();
  EXPECT_EQ(matrix_of(part.frames()), all.middleCols(2, 3));
  EXPECT_EQ(part.frames_left(), 15u);
  request.mutable_get_frames()->set_result_sequence(1);
  EXPECT_EQ(client.call(request).error().field(), "result_sequence");
  request.mutable_get_frames()->clear_result_sequence();
  request.mutable_get_frames()->set_encoding(proto::ENCODING_COORDINATES);
  EXPECT_EQ(client.call(request).error().field(), "encoding");
  request.mutable_get_frames()->clear_encoding();
  request.mutable_get_frames()->set_final_only(true);
  EXPECT_EQ(client.call(request).error().field(), "final_only");
  request.mutable_get_frames()->set_session("s");
  EXPECT_EQ(client.call(request).error().field(), "job");
}

TEST_F(ServerSimulations, FilesHoldTheMotionAndTheSceneEditsIt) {
  const std::uint64_t job = simulated(falling_bar());
  const Eigen::MatrixXf positions = matrix_of(frames(job).get_frames().frames());
  const auto cache = exported(job, proto::EXPORT_FORMAT_PC2).export_();
  ASSERT_EQ(cache.files_size(), 2);
  EXPECT_EQ(scene::read_pc2("fall.pc2", cache.files(1).content()).positions, positions);
  const auto series = exported(job, proto::EXPORT_FORMAT_PVD).export_();
  EXPECT_EQ(series.files_size(), 21);
  const auto edited = exported(job, proto::EXPORT_FORMAT_SCENE).export_();
  ASSERT_EQ(edited.files_size(), 3);
  const proto::Scene scene = scene_from_json(edited.files(0).content());
  EXPECT_EQ(scene.base_motion().path(), edited.files(2).name());
  EXPECT_EQ(scene::read_pc2("", edited.files(2).content()).positions, positions);
  EXPECT_TRUE(scene.has_simulation());
}

TEST_F(ServerSimulations, ALongOneCanBeCancelled) {
  proto::Scene scene = falling_bar();
  scene.set_frames(100'000);  // hours
  scene.mutable_simulation()->set_steps_per_frame(10'000);
  const std::uint64_t job = simulate(scene).simulate().job();
  EXPECT_EQ(client.call(job_request(job, 0.05)).get_job().status().state(),
            proto::JOB_STATE_RUNNING);
  EXPECT_THAT(frames(job).error().message(), HasSubstr("still runs"));
  proto::Request request;
  request.mutable_cancel()->set_job(job);
  ASSERT_TRUE(client.call(request).has_cancel());
  EXPECT_EQ(client.call(job_request(job, 30)).get_job().status().state(),
            proto::JOB_STATE_CANCELLED);
  const auto error = frames(job).error();
  EXPECT_EQ(error.code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_THAT(error.message(), HasSubstr("ended without a motion"));
}

TEST_F(ServerSimulations, RefusalsNameTheField) {
  proto::Scene scene = falling_bar();
  scene.mutable_simulation()->add_forces()->add_nodes(kNodes);
  EXPECT_EQ(simulate(scene).error().field(), "scene.simulation.forces[0].nodes[0]");
  scene.clear_simulation();
  EXPECT_EQ(simulate(scene).error().field(), "scene.simulation");
  scene = falling_bar();
  scene.mutable_simulation()->mutable_initial()->mutable_displacements()->set_type(
      proto::DATA_TYPE_FLOAT32);
  EXPECT_THAT(simulate(scene).error().field(), HasSubstr("scene.simulation.initial.displacements"));
  EXPECT_EQ(frames(77).error().code(), proto::ERROR_CODE_NOT_FOUND);
}

TEST_F(ServerSimulations, MotionsOfTheNewestFourAreKept) {
  proto::Scene scene = falling_bar();
  scene.set_frames(5);
  std::vector<std::uint64_t> jobs;
  for (int i = 0; i < 5; ++i) jobs.push_back(simulated(scene));
  EXPECT_THAT(frames(jobs[0]).error().message(), HasSubstr("too old"));
  EXPECT_TRUE(frames(jobs[1]).has_get_frames());
}

TEST_F(ServerSimulations, MoreThanASessionMayTakeIsRefused) {
  ServerOptions options = test_options();
  options.limits.session_bytes = 1 << 20;
  RunningServer small(options);
  Client other(small->request_endpoint());
  proto::Scene scene = falling_bar();
  scene.set_frames(90'000);
  proto::Request request;
  *request.mutable_simulate()->mutable_scene() = scene;
  EXPECT_EQ(other.call(request).error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
}

}  // namespace
}  // namespace limber::server
