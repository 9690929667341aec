// Motions that come in parts, as the client asks for them.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <string>
#include <vector>

#include "clients/cpp/open_session.h"
#include "clients/cpp/part_size.h"
#include "tests/clients/fake_router.h"

namespace limber::client {
namespace {

constexpr std::uint32_t kMotionFrames = 10;

/// Answers with at most three frames of one number; each request without a result finds a newer
/// one.
struct FrameParts : ::testing::Test {
  std::vector<std::string> answer(const v1::Request& request) {
    v1::Reply reply;
    if (request.has_get_frames()) {
      answer_frames(request.get_frames(), reply);
    } else {
      reply.mutable_get_session();
    }
    reply.set_version(1);
    reply.set_id(request.id());
    return {reply.SerializeAsString()};
  }
  void answer_frames(const v1::GetFramesRequest& wanted, v1::Reply& reply) {
    asked.push_back(wanted);
    const std::uint64_t begun = wanted.result_sequence();
    if (begun != 0 && displaced > 0) {
      --displaced;
      reply.mutable_error()->set_code(v1::ERROR_CODE_FAILED_PRECONDITION);
      reply.mutable_error()->set_field("result_sequence");
      return;
    }
    const std::uint64_t sequence = begun != 0 ? begun : ++newest;
    const std::uint32_t count =
        wanted.frame_count() != 0 ? wanted.frame_count() : kMotionFrames - wanted.first_frame();
    const std::uint32_t part = wanted.most_bytes() != 0 ? std::min(3U, count) : count;
    reply.mutable_get_frames()->set_frames_left(count - part);
    auto& frames = *reply.mutable_get_frames()->mutable_frames();
    frames.mutable_result()->set_sequence(sequence);
    frames.set_first_frame(wanted.first_frame());
    frames.set_frame_count(part);
    frames.mutable_data()->set_type(v1::DATA_TYPE_FLOAT32);
    frames.mutable_data()->add_shape(part);
    frames.mutable_data()->add_shape(1);
    for (std::uint32_t i = 0; i < part; ++i) {
      const auto value = static_cast<float>(100 * sequence + wanted.first_frame() + i);
      frames.mutable_data()->mutable_data()->append(reinterpret_cast<const char*>(&value),
                                                    sizeof value);
    }
  }
  static std::vector<float> values_of(const v1::Frames& frames) {
    EXPECT_EQ(frames.data().shape(0), frames.frame_count());
    std::vector<float> values(frames.data().data().size() / sizeof(float));
    std::memcpy(values.data(), frames.data().data().data(), frames.data().data().size());
    return values;
  }
  static std::vector<float> numbers(std::uint64_t sequence, std::uint32_t first,
                                    std::uint32_t count) {
    std::vector<float> values;
    for (std::uint32_t i = 0; i < count; ++i)
      values.push_back(static_cast<float>(100 * sequence + first + i));
    return values;
  }

  std::vector<v1::GetFramesRequest> asked;
  std::uint64_t newest = 0;
  int displaced = 0;  // so many parts behind the first are refused
  FakeRouter router{[this](const v1::Request& request) { return answer(request); }};
  Client client{router.requests()};
  OpenSession session{client, "s"};
};

TEST_F(FrameParts, OfOneResultArePutTogether) {
  const v1::Frames frames = session.frames({.first = 1, .count = 8});
  EXPECT_EQ(frames.first_frame(), 1U);
  EXPECT_EQ(values_of(frames), numbers(1, 1, 8));
  ASSERT_EQ(asked.size(), 3U);
  EXPECT_EQ(asked[1].first_frame(), 4U);
  EXPECT_EQ(asked[1].frame_count(), 5U);
  EXPECT_EQ(asked[1].result_sequence(), 1U);
  EXPECT_EQ(asked[2].first_frame(), 7U);
}

/// The size of parts in the end, over a link.
std::uint64_t size_over(double way_s, double bytes_per_s) {
  PartSize size;
  for (int i = 0; i < 20; ++i) {
    const std::chrono::duration<double> time(way_s +
                                             static_cast<double>(size.bytes()) / bytes_per_s);
    size.note(std::chrono::duration_cast<std::chrono::steady_clock::duration>(time));
  }
  return size.bytes();
}

TEST(PartSizes, FollowTheLinkWithinBounds) {
  EXPECT_EQ(size_over(1e-4, 1e9), PartSize::kMost);
  EXPECT_EQ(size_over(1e-4, 12.5e6), 4 * PartSize::kLeast);
  EXPECT_LE(size_over(1e-4, 1e6), 2 * PartSize::kLeast);
  EXPECT_EQ(size_over(0.1, 1e9), PartSize::kMost) << "a long way is no slow link";
}

TEST_F(FrameParts, OfAResultThatWasDisplacedAreFetchedAnew) {
  displaced = 2;
  EXPECT_EQ(values_of(session.frames()), numbers(3, 0, kMotionFrames));
}

TEST_F(FrameParts, ThatAreDisplacedEachTimeComeWhole) {
  displaced = 1000;
  const v1::Frames frames = session.frames();
  EXPECT_EQ(values_of(frames), numbers(newest, 0, kMotionFrames));
  EXPECT_EQ(asked.back().most_bytes(), 0U);
}

TEST_F(FrameParts, OfQuantisedPositionsAreNotAskedFor) {
  EXPECT_EQ(session.frames({.encoding = v1::ENCODING_POSITIONS_QUANTISED}).frame_count(),
            kMotionFrames);
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(asked[0].most_bytes(), 0U);
}

}  // namespace
}  // namespace limber::client
