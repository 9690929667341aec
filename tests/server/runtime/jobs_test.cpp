#include <gtest/gtest.h>

#include "engine/scene/formats/mesh_formats.h"
#include "server/runtime/job_registry.h"
#include "server/wire/scene_json.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

/// A closed box from 0 to 1.
constexpr const char* kBox =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

struct ServerJobs : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};
};

TEST_F(ServerJobs, OpeningIsAJobThatEndsWithTheFirstFinalResult) {
  const auto opened = client.call(open_request(small_scene(), "s")).open_session();
  const auto job = client.call(job_request(opened.job(), 30)).get_job();
  EXPECT_EQ(job.status().state(), proto::JOB_STATE_DONE);
  EXPECT_EQ(job.status().kind(), "open_session");
  EXPECT_EQ(job.status().session(), "s");
  EXPECT_EQ(job.status().progress().fraction(), 1);
  proto::Request request;
  request.mutable_get_session()->set_session("s");
  EXPECT_TRUE(client.call(request).get_session().status().result().converged());
  request.mutable_list_jobs();
  EXPECT_EQ(client.call(request).list_jobs().jobs_size(), 1);
}

TEST_F(ServerJobs, ABuildThatIsCancelledSaysSo) {
  const auto opened = client.call(open_request(small_scene(600, 300), "s")).open_session();
  proto::Request request;
  request.mutable_cancel()->set_session("s");
  ASSERT_TRUE(client.call(request).has_cancel());
  const auto job = client.call(job_request(opened.job(), 30)).get_job();
  ASSERT_EQ(job.status().state(), proto::JOB_STATE_CANCELLED);
  // A wait on it does not hang, and a cold solve builds it after all.
  EXPECT_EQ(client.call(wait_request("s", 0, 30)).error().code(),
            proto::ERROR_CODE_FAILED_PRECONDITION);
  request.mutable_solve_cold()->set_session("s");
  const auto again = client.call(request).solve_cold().job();
  EXPECT_EQ(client.call(job_request(again, 60)).get_job().status().state(), proto::JOB_STATE_DONE);
  EXPECT_TRUE(client.call(wait_request("s", 0, 30)).has_wait());
}

TEST_F(ServerJobs, ColdSolvesComeToTheSameAnswer) {
  open_and_solve(client, "s");
  const auto warm = client.call(wait_request("s", 0)).wait().result();
  proto::Request request;
  request.mutable_solve_cold()->set_session("s");
  const auto job = client.call(request).solve_cold().job();
  EXPECT_EQ(client.call(job_request(job, 30)).get_job().status().state(), proto::JOB_STATE_DONE);
  const auto cold = client.call(wait_request("s", 0)).wait().result();
  EXPECT_GT(cold.sequence(), warm.sequence());
  EXPECT_NEAR(cold.total_energy(), warm.total_energy(), 1e-6 * warm.total_energy());
}

TEST_F(ServerJobs, TetrahedralizeReturnsAMeshThatCanBeOpened) {
  proto::Request request;
  request.mutable_tetrahedralize()->mutable_surface()->set_name("box.obj");
  request.mutable_tetrahedralize()->mutable_surface()->set_content(kBox);
  request.mutable_tetrahedralize()->set_target_tets(500);
  const auto started = client.call(request);
  ASSERT_TRUE(started.has_tetrahedralize()) << started.ShortDebugString();
  const auto job = client.call(job_request(started.tetrahedralize().job(), 60)).get_job();
  ASSERT_EQ(job.status().state(), proto::JOB_STATE_DONE) << job.status().ShortDebugString();
  EXPECT_NEAR(static_cast<double>(job.mesh().tets().shape(0)), 500, 100);
  const auto& report = job.tetrahedralization();
  EXPECT_EQ(static_cast<std::int64_t>(report.tets()), job.mesh().tets().shape(0));
  EXPECT_LE(report.distance_share(), 0.02);
  EXPECT_GT(report.surface_to_mesh(), 0);
  EXPECT_EQ(report.within(), 0.02);
  EXPECT_NEAR(report.mesh_volume(), report.surface_volume(), 0.1 * report.surface_volume());
  int cut = 0;
  for (const auto& issue : job.issues())
    cut += issue.message() == "6 polygons are cut into triangles" ? 1 : 0;
  EXPECT_EQ(cut, 1);
  proto::Scene scene = small_scene();
  *scene.mutable_mesh()->mutable_arrays() = job.mesh();
  scene.clear_constraints();
  scene.clear_fixed_nodes();
  request.mutable_validate_scene();
  *request.mutable_validate_scene()->mutable_scene() = scene;
  const auto reply = client.call(request);
  for (const auto& issue : reply.validate_scene().issues()) {
    EXPECT_NE(issue.severity(), proto::Issue::SEVERITY_ERROR) << issue.ShortDebugString();
  }
}

TEST_F(ServerJobs, TetrahedralizeWithTooFewTetsFailsWithTheNumberThatWouldDo) {
  proto::Request request;
  request.mutable_tetrahedralize()->mutable_surface()->set_name("box.obj");
  request.mutable_tetrahedralize()->mutable_surface()->set_content(kBox);
  request.mutable_tetrahedralize()->set_target_tets(50);
  const auto started = client.call(request);
  const auto job = client.call(job_request(started.tetrahedralize().job(), 60)).get_job();
  ASSERT_EQ(job.status().state(), proto::JOB_STATE_FAILED) << job.status().ShortDebugString();
  EXPECT_EQ(job.status().error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(job.status().error().field(), "within");
  request.mutable_tetrahedralize()->set_within(0);
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_INVALID_ARGUMENT);
}

TEST_F(ServerJobs, SurfacesThatEncloseNothingAreRefused) {
  proto::Request request;
  request.mutable_tetrahedralize()->mutable_surface()->set_name("open.obj");
  request.mutable_tetrahedralize()->mutable_surface()->set_content(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  request.mutable_tetrahedralize()->mutable_surface()->set_content(kBox);
  request.mutable_tetrahedralize()->set_target_tets(1'000'000'000);
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
}

TEST_F(ServerJobs, SamplesAreNamedAndComplete) {
  proto::Request request;
  request.mutable_get_sample();
  const auto names = client.call(request).get_sample().names();
  EXPECT_GE(names.size(), 4);
  request.mutable_get_sample()->set_name("beam");
  proto::Scene scene = client.call(request).get_sample().scene();
  EXPECT_EQ(scene.mesh().sample(), "beam");
  *request.mutable_validate_scene()->mutable_scene() = scene;
  const auto reply = client.call(request);
  for (const auto& issue : reply.validate_scene().issues()) {
    EXPECT_NE(issue.severity(), proto::Issue::SEVERITY_ERROR) << issue.ShortDebugString();
  }
}

TEST(JobRegistry, FinishedJobsAreKeptUpToABound) {
  boost::asio::io_context control;
  int notifications = 0;
  JobRegistry jobs(control, 2, [&](const proto::JobStatus&) { ++notifications; });
  const JobId first = jobs.start("a", "", {});
  const JobId second = jobs.start("a", "", {});
  EXPECT_THROW(jobs.start("a", "", {}), Refusal);
  jobs.done(first);
  jobs.done(first);  // the first end counts
  jobs.failed(first, {});
  EXPECT_EQ(jobs.status(first).state(), proto::JOB_STATE_DONE);
  for (int i = 0; i < 1000; ++i) jobs.done(jobs.start("b", "", {}));
  EXPECT_LE(jobs.list().size(), 300u);
  EXPECT_EQ(jobs.status(second).state(), proto::JOB_STATE_RUNNING);
  EXPECT_THROW((void)jobs.status(first), Refusal);
  EXPECT_EQ(notifications, 2 + 1 + 2000);
}

TEST(JobRegistry, AStoppedJobThatFailsIsCancelled) {
  boost::asio::io_context control;
  JobRegistry jobs(control, 2, [](const proto::JobStatus&) {});
  int calls = 0;
  const JobId job = jobs.start("a", "", [&] { ++calls; });
  jobs.cancel(job);
  EXPECT_EQ(calls, 1);
  jobs.failed(job, {});
  EXPECT_EQ(jobs.status(job).state(), proto::JOB_STATE_CANCELLED);
  jobs.cancel(job);  // ended: nothing to ask
  EXPECT_EQ(calls, 1);
  EXPECT_THROW(jobs.cancel(99), Refusal);
}

}  // namespace
}  // namespace limber::server
