// Frames of a motion in parts, all of one result.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <thread>

#include "server/runtime/frame_transfers.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

constexpr std::uint64_t kFrameBytes = 28 * 12;  // positions of small_scene()

float largest_difference(const std::string& one, const std::string& other) {
  if (one.size() != other.size()) return std::numeric_limits<float>::infinity();
  const auto count = static_cast<Eigen::Index>(one.size() / sizeof(float));
  const auto values = [count](const std::string& bytes) {
    return Eigen::Map<const Eigen::ArrayXf>(reinterpret_cast<const float*>(bytes.data()), count);
  };
  return (values(one) - values(other)).abs().maxCoeff();
}

struct ServerFrameParts : ::testing::Test {
  void SetUp() override {
    open_and_solve(client, "s");
    // Behind it comes nothing more of this revision.
    const auto checked = wait_request("s", 0, 60, proto::WaitRequest::UNTIL_CHECKED);
    ASSERT_TRUE(client.call(checked).has_wait());
  }
  proto::Reply frames(std::uint32_t first, std::uint32_t count, std::uint64_t most_bytes,
                      std::uint64_t result = 0,
                      proto::Encoding encoding = proto::ENCODING_POSITIONS) {
    proto::Request request;
    auto& wanted = *request.mutable_get_frames();
    wanted.set_session("s");
    wanted.set_encoding(encoding);
    wanted.set_first_frame(first);
    wanted.set_frame_count(count);
    wanted.set_most_bytes(most_bytes);
    wanted.set_result_sequence(result);
    return client.call(request);
  }
  void edit(std::uint64_t revision) {
    const double y = 0.01 * static_cast<double>(revision);
    ASSERT_TRUE(client.call(move_request("s", 1, 0, y, 0)).has_edit());
    ASSERT_TRUE(client.call(wait_request("s", revision)).has_wait());
  }
  RunningServer server;
  Client client{server->request_endpoint()};
};

TEST_F(ServerFrameParts, AreOfOneResultThoughEditsGoOn) {
  const auto whole = frames(0, 0, 0).get_frames();
  EXPECT_EQ(whole.frames_left(), 0u);
  ASSERT_EQ(whole.frames().frame_count(), 20u);
  auto answer = frames(0, 0, 6 * kFrameBytes + 5).get_frames();
  EXPECT_EQ(answer.frames_left(), 14u);
  const std::uint64_t sequence = answer.frames().result().sequence();
  ASSERT_EQ(whole.frames().result().sequence(), sequence);
  std::string data = answer.frames().data().data();
  std::uint64_t revision = 0;
  int parts = 1;
  for (std::uint32_t at = 6; answer.frames_left() > 0; ++parts) {
    edit(++revision);
    answer = frames(at, answer.frames_left(), 6 * kFrameBytes, sequence).get_frames();
    EXPECT_EQ(answer.frames().first_frame(), at);
    EXPECT_EQ(answer.frames().result().sequence(), sequence);
    EXPECT_EQ(answer.frames().result().revision(), 0u);
    at += answer.frames().frame_count();
    data += answer.frames().data().data();
  }
  EXPECT_EQ(parts, 4);
  EXPECT_LT(largest_difference(data, whole.frames().data().data()), 1e-6F);  // but for rounding
  EXPECT_GT(largest_difference(data, frames(0, 0, 0).get_frames().frames().data().data()), 1e-3F);
  // The answer may have been lost: it is asked for again.
  const auto again = frames(18, 2, 0, sequence).get_frames();
  EXPECT_EQ(again.frames().result().sequence(), sequence);
  EXPECT_EQ(again.frames_left(), 0u);
}

TEST_F(ServerFrameParts, TakeMemoryOfTheSession) {
  const auto memory = [this] {
    proto::Request request;
    request.mutable_get_session()->set_session("s");
    return client.call(request).get_session().status().memory_bytes();
  };
  const std::uint64_t before = memory();
  const auto modes = frames(0, 0, 1, 0, proto::ENCODING_COORDINATES).get_frames();
  EXPECT_GE(memory(), before + modes.frames().data().shape(1) * 20 * sizeof(float));
  // They go by themselves, once the end was fetched: soon.
  const std::uint64_t sequence = modes.frames().result().sequence();
  EXPECT_EQ(frames(19, 1, 0, sequence).get_frames().frames_left(), 0u);
  const auto end = FrameTransfers::Clock::now() + 3 * FrameTransfers::kPatienceBehindLast;
  while (memory() > before && FrameTransfers::Clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(memory(), before);
}

TEST_F(ServerFrameParts, OfCoordinatesKeepTheirBasis) {
  const auto first = frames(0, 0, 1, 0, proto::ENCODING_COORDINATES).get_frames();
  ASSERT_GT(first.frames_left(), 0u);
  proto::Request request;
  auto& wanted = *request.mutable_get_geometry();
  wanted.set_session("s");
  wanted.set_basis_hash(first.frames().basis_hash());
  const auto basis = client.call(request).get_geometry();
  std::set<std::string> bases{first.frames().basis_hash()};
  for (std::uint64_t revision = 1; bases.size() < 7 && revision < 400; ++revision) {
    const double turn = static_cast<double>(revision), large = 0.15 * turn;
    ASSERT_TRUE(client
                    .call(move_request("s", 1, large * std::cos(turn), large * std::sin(turn),
                                       large * std::sin(3 * turn)))
                    .has_edit());
    ASSERT_TRUE(client.call(wait_request("s", revision)).has_wait());
    bases.insert(
        frames(0, 0, 0, 0, proto::ENCODING_COORDINATES).get_frames().frames().basis_hash());
  }
  ASSERT_EQ(bases.size(), 7u) << "the session itself keeps four";
  const auto later = client.call(request);
  ASSERT_TRUE(later.has_get_geometry()) << later.error().message();
  EXPECT_EQ(later.get_geometry().basis().data(), basis.basis().data());
}

TEST_F(ServerFrameParts, HaveAFrameAtLeast) {
  auto answer = frames(3, 2, 1).get_frames();
  EXPECT_EQ(answer.frames().frame_count(), 1u);
  EXPECT_EQ(answer.frames_left(), 1u);
  answer = frames(4, answer.frames_left(), 1, answer.frames().result().sequence()).get_frames();
  EXPECT_EQ(answer.frames().first_frame(), 4u);
  EXPECT_EQ(answer.frames_left(), 0u);
}

TEST_F(ServerFrameParts, WhatHasRoomComesWhole) {
  for (const std::uint64_t bytes : {20 * kFrameBytes, ~std::uint64_t{0}}) {
    const auto answer = frames(0, 0, bytes).get_frames();
    EXPECT_EQ(answer.frames().frame_count(), 20u);
    EXPECT_EQ(answer.frames_left(), 0u);
    EXPECT_EQ(frames(0, 1, 0, answer.frames().result().sequence()).error().field(),
              "result_sequence")
        << "nothing is kept for it";
  }
}

TEST_F(ServerFrameParts, OfEachEncodingCountItsBytes) {
  const auto coordinates = frames(0, 0, 64, 0, proto::ENCODING_COORDINATES).get_frames();
  const auto modes = coordinates.frames().data().shape(1);
  EXPECT_EQ(coordinates.frames().frame_count(), 64 / (4 * modes));
  EXPECT_EQ(frames(0, 0, 5 * kFrameBytes, 0, proto::ENCODING_POSITIONS_QUANTISED)
                .get_frames()
                .frames()
                .frame_count(),
            10u);
}

TEST_F(ServerFrameParts, OfAResultThatWasNotBegunAreRefused) {
  const auto sequence = frames(0, 0, 0).get_frames().frames().result().sequence();
  for (const std::uint64_t other : {sequence, sequence + 1, ~std::uint64_t{0}}) {
    const auto refused = frames(1, 0, 1, other);
    EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
    EXPECT_EQ(refused.error().field(), "result_sequence");
  }
}

TEST(ServerFramePartsOfALimit, AMotionLargerThanAMessageComesInParts) {
  ServerOptions options = test_options();
  options.transport.message_bytes = 8192;
  RunningServer server(options);
  Client client(server->request_endpoint());
  open_and_solve(client, "s", small_scene(6, 60));
  proto::Request request;
  auto& wanted = *request.mutable_get_frames();
  wanted.set_session("s");
  wanted.set_encoding(proto::ENCODING_POSITIONS);
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  wanted.set_most_bytes(1 << 20);
  const auto answer = client.call(request).get_frames();
  EXPECT_EQ(answer.frames().frame_count(), 8192 / kFrameBytes);
  EXPECT_EQ(answer.frames_left(), 60 - 8192 / kFrameBytes);
}

}  // namespace
}  // namespace limber::server
