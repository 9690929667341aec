#include "server/runtime/run.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

TEST(ServerRun, IdsOfTwoRunsDifferAndAreExactInJson) {
  std::set<std::string> instances;
  std::set<std::uint64_t> firsts;
  for (int i = 0; i < 100; ++i) {
    const server::Run run = server::Run::begin();
    instances.insert(run.instance);
    firsts.insert(run.first_id);
    EXPECT_EQ(run.instance.size(), 16u);
    RunIds ids(run.first_id);
    const std::uint64_t id = ids.next();
    EXPECT_LT(id, 1ull << 52);
    EXPECT_EQ(std::to_string(id).size(), 16u);
    EXPECT_FALSE(ids.is_of_another_run(id));
    EXPECT_TRUE(ids.is_of_another_run(server::Run::begin().first_id + 1));
  }
  EXPECT_EQ(instances.size(), 100u);
  EXPECT_EQ(firsts.size(), 100u);
}

TEST(ServerRun, SmallNumbersAreOfNoRun) {
  const RunIds ids(server::Run::begin().first_id);
  for (const std::uint64_t id : {0ull, 7ull, 1'000'000ull, ~0ull})
    EXPECT_FALSE(ids.is_of_another_run(id));
}

TEST(ServerRun, SessionsAreGivenByNameOrNameAndUid) {
  EXPECT_EQ(SessionKey::parse("cup").name, "cup");
  EXPECT_EQ(SessionKey::parse("cup").uid, 0u);
  const SessionKey key = SessionKey::parse("cup@42");
  EXPECT_EQ(key.name, "cup");
  EXPECT_EQ(key.uid, 42u);
  EXPECT_EQ(key.reference(), "cup@42");
  for (const char* text :
       {"cup@", "cup@x", "cup@-1", "cup@1 ", "cup@1@2", "cup@0", "cup@99999999999999999999999"})
    EXPECT_THROW((void)SessionKey::parse(text), Refusal) << text;
}

TEST(ServerRun, EachSessionHasOneReference) {
  const std::uint64_t id = server::Run::begin().first_id + 1;
  const std::string uid = std::to_string(id);
  EXPECT_EQ(SessionKey::parse("cup@" + uid).uid, id);
  for (const auto& text :
       {std::string("cup@007"), "cup@0" + uid, "cup@1" + uid, "cup@" + std::string(200, '0') + uid})
    EXPECT_THROW((void)SessionKey::parse(text), Refusal) << text;
}

/// What a client of one run asks of another run, on which a stranger has a session of that name.
struct ServerOfAnotherRun : ::testing::Test {
  /// A uid and a job of a run that has ended.
  ServerOfAnotherRun() {
    RunningServer before;
    Client client(before->request_endpoint());
    const auto opened = client.call(open_request(small_scene(), "cup"));
    instance = opened.instance();
    uid = opened.open_session().uid();
    job = opened.open_session().job();
    open_and_solve(stranger, "cup");
  }
  proto::Error refusal(const proto::Request& request) {
    const auto reply = stranger.call(request);
    EXPECT_TRUE(reply.has_error()) << reply.ShortDebugString();
    return reply.error();
  }
  std::string stale() const { return "cup@" + std::to_string(uid); }

  std::string instance;
  std::uint64_t uid = 0, job = 0;
  RunningServer server;
  Client stranger{server->request_endpoint()};
};

TEST_F(ServerOfAnotherRun, RefusesRequestsMeantForTheOther) {
  auto edit = move_request("cup", 1, 0, 0.1, 0);
  edit.set_instance(instance);
  const auto refused = refusal(edit);
  EXPECT_EQ(refused.code(), proto::ERROR_CODE_RESTARTED);
  EXPECT_NE(refused.message().find("the server was restarted"), std::string::npos);
  edit.set_instance(stranger.call(info_request()).get_server_info().instance());
  EXPECT_TRUE(stranger.call(edit).has_edit());
}

TEST_F(ServerOfAnotherRun, LeavesAStrangersSessionAlone) {
  std::vector<proto::Request> requests;
  requests.push_back(move_request(stale(), 1, 0, 0.1, 0));
  requests.push_back(wait_request(stale(), 0));
  for (int i = 0; i < 7; ++i) requests.emplace_back();
  auto next = requests.begin() + 2;
  (next++)->mutable_get_session()->set_session(stale());
  (next++)->mutable_close_session()->set_session(stale());
  (next++)->mutable_cancel()->set_session(stale());
  (next++)->mutable_get_frames()->set_session(stale());
  (next++)->mutable_get_geometry()->set_session(stale());
  (next++)->mutable_solve_cold()->set_session(stale());
  (next++)->mutable_pause_design()->set_session(stale());
  for (const auto& request : requests) {
    const auto refused = refusal(request);
    EXPECT_EQ(refused.code(), proto::ERROR_CODE_RESTARTED) << request.ShortDebugString();
    EXPECT_EQ(refused.field(), "session");
  }
  proto::Request get;
  get.mutable_get_session()->set_session("cup");
  const auto status = stranger.call(get).get_session().status();
  EXPECT_EQ(status.revision(), 0u);
  EXPECT_EQ(status.state(), proto::SESSION_STATE_READY);
  EXPECT_NE(status.uid(), uid);
}

TEST_F(ServerOfAnotherRun, KnowsJobsThatAreNotItsOwn) {
  std::vector<proto::Request> requests(4);
  requests[0].mutable_get_job()->set_job(job);
  requests[1].mutable_cancel()->set_job(job);
  requests[2].mutable_get_frames()->set_job(job);
  requests[3].mutable_export_()->set_job(job);
  requests[3].mutable_export_()->set_format(proto::EXPORT_FORMAT_PC2);
  for (const auto& request : requests) {
    EXPECT_EQ(refusal(request).code(), proto::ERROR_CODE_RESTARTED) << request.ShortDebugString();
  }
  requests[0].mutable_get_job()->set_job(7);
  EXPECT_EQ(refusal(requests[0]).code(), proto::ERROR_CODE_NOT_FOUND);
}

TEST(ServerSessionUids, ANameTakenAgainIsAnotherSession) {
  RunningServer server;
  Client client(server->request_endpoint());
  const auto uid = client.call(open_request(small_scene(), "cup")).open_session().uid();
  proto::Request get, close;
  const std::string first = "cup@" + std::to_string(uid);
  get.mutable_get_session()->set_session(first);
  EXPECT_EQ(client.call(get).get_session().status().uid(), uid);
  close.mutable_close_session()->set_session(first);
  ASSERT_TRUE(client.call(close).has_close_session());
  EXPECT_EQ(client.call(get).error().code(), proto::ERROR_CODE_NOT_FOUND);
  open_and_solve(client, "cup");
  const auto refused = client.call(close).error();
  EXPECT_EQ(refused.code(), proto::ERROR_CODE_NOT_FOUND);
  EXPECT_EQ(refused.message(), "session 'cup' was closed; another one has its name");
  get.mutable_get_session()->set_session("cup");
  EXPECT_NE(client.call(get).get_session().status().uid(), uid);
}

TEST(ServerSessionUids, NamesChosenByTheServerAreOfItsRun) {
  std::set<std::string> names;
  for (int run = 0; run < 2; ++run) {
    RunningServer server;
    Client client(server->request_endpoint());
    const auto opened = client.call(open_request(small_scene()));
    names.insert(opened.open_session().session());
    EXPECT_NE(opened.open_session().session().find(opened.instance().substr(0, 8)),
              std::string::npos);
  }
  EXPECT_EQ(names.size(), 2u);
}

TEST(ServerSessionUids, MessagesOfTheStreamSayTheirRunAndSession) {
  RunningServer server;
  Client client(server->request_endpoint());
  Subscriber subscriber(server->stream_endpoint());
  subscriber.subscribe("session/cup/status");
  const auto opened = client.call(open_request(small_scene(), "cup"));
  const auto message = subscriber.receive();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->content.instance(), opened.instance());
  EXPECT_EQ(message->content.session_uid(), opened.open_session().uid());
}

}  // namespace
}  // namespace limber::server
