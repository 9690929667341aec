#include "server/runtime/change_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "clients/cpp/motion_buffer.h"

namespace limber::server {
namespace {

using client::MotionBuffer;
using Outcome = MotionBuffer::Outcome;

/// Frames of a made-up result.
class Source final : public FrameSource {
 public:
  Source(std::uint64_t sequence, Eigen::MatrixXf coordinates, std::string hash = "b", int first = 0)
      : sequence_(sequence),
        coordinates_(std::move(coordinates)),
        hash_(std::move(hash)),
        first_(first) {}
  [[nodiscard]] std::uint64_t sequence() const override { return sequence_; }
  [[nodiscard]] int frame_count() const override { return static_cast<int>(coordinates_.cols()); }
  [[nodiscard]] const Eigen::MatrixXf* coordinates() const override { return &coordinates_; }
  [[nodiscard]] std::string basis_hash() const override { return hash_; }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding /*encoding*/, int count) const override {
    return static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(coordinates_.rows()) * 4;
  }
  [[nodiscard]] proto::Frames encode(proto::Encoding encoding, FrameRange range) const override {
    proto::ResultInfo info;
    info.set_sequence(sequence_);
    proto::Frames frames = frames_of(info, encoding, {first_ + range.first, range.count});
    frames.set_basis_hash(hash_);
    set_coordinates(coordinates_.middleCols(range.first, range.count), frames);
    return frames;
  }

 private:
  std::uint64_t sequence_;
  Eigen::MatrixXf coordinates_;
  std::string hash_;
  int first_;
};

constexpr std::uint64_t kChunk = 64 << 20;
constexpr int kFrames = 10'000;

Eigen::MatrixXf motion_of(int frames) {
  Eigen::MatrixXf motion(3, frames);
  for (int i = 0; i < frames; ++i)
    motion.col(i) << std::sin(0.01F * static_cast<float>(i)), 0.3F,
        std::cos(0.02F * static_cast<float>(i));
  return motion;
}

using Ranges = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
Ranges ranges_of(const std::vector<proto::Frames>& messages) {
  Ranges ranges;
  for (const proto::Frames& frames : messages)
    ranges.emplace_back(frames.first_frame(), frames.frame_count());
  return ranges;
}

struct ChangesOfAMotion : ::testing::Test {
  ChangesOfAMotion() { put(stream.advance(Source(1, motion))); }

  void put(const std::vector<proto::Frames>& messages) {
    for (const proto::Frames& frames : messages) last = client.put(frames);
  }
  [[nodiscard]] Eigen::MatrixXf held() const {
    return Eigen::Map<const Eigen::MatrixXd>(client.coordinates().data(),
                                             static_cast<Eigen::Index>(client.size()),
                                             static_cast<Eigen::Index>(client.frame_count()))
        .cast<float>();
  }

  Eigen::MatrixXf motion = motion_of(kFrames);
  ChangeStream stream{kChunk};
  MotionBuffer client;
  Outcome last = Outcome::kIgnored;
};

TEST_F(ChangesOfAMotion, BeginWithAllOfIt) {
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(held(), motion);
  EXPECT_EQ(client.sequence(), 1u);
}

TEST_F(ChangesOfAMotion, AreSentAndNothingElse) {
  motion.middleCols(5'000, 20).array() += 0.1F;
  const auto messages = stream.advance(Source(2, motion));
  EXPECT_EQ(ranges_of(messages), (Ranges{{4'992, 64}})) << "the block of 64 frames that it lies in";
  EXPECT_EQ(messages[0].changes().base_sequence(), 1u);
  EXPECT_EQ(messages[0].changes().motion_frames(), 10'000u);
  put(messages);
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(held(), motion);
}

TEST_F(ChangesOfAMotion, OfAnAmendmentAreNone) {
  const auto messages = stream.advance(Source(2, motion));
  EXPECT_EQ(ranges_of(messages), (Ranges{{0, 0}}));
  EXPECT_FALSE(messages[0].changes().more());
  put(messages);
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(client.sequence(), 2u);
  EXPECT_EQ(held(), motion);
}

TEST_F(ChangesOfAMotion, DoNotAddUpUnseen) {
  const float spacing = std::numeric_limits<float>::epsilon();
  std::size_t sent = 0;
  for (std::uint64_t sequence = 2; sequence < 200; ++sequence) {
    motion.array() += 0.5F * spacing;
    const auto messages = stream.advance(Source(sequence, motion));
    put(messages);
    for (const proto::Frames& frames : messages) sent += frames.frame_count();
    ASSERT_LE((held() - motion).cwiseAbs().maxCoeff(),
              1.01F * spacing * motion.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(sent, 0u);
  EXPECT_LT(sent, 198u * kFrames / 2) << "not every time";
}

TEST_F(ChangesOfAMotion, ComeInTheOrderInWhichTheyMatter) {
  motion.middleCols(1'000, 10).array() += 0.01F;
  motion.middleCols(4'000, 10).array() += 0.5F;
  motion.middleCols(8'000, 10).array() += 0.001F;
  const auto messages = stream.advance(Source(2, motion), {{7'990, 100}});
  EXPECT_EQ(ranges_of(messages), (Ranges{{8'000, 64}, {3'968, 64}, {960, 64}}))
      << "looked at, then the largest";
  EXPECT_TRUE(messages[0].changes().more());
  EXPECT_TRUE(messages[1].changes().more());
  EXPECT_FALSE(messages[2].changes().more());
  put(messages);
  EXPECT_EQ(held(), motion);
}

TEST_F(ChangesOfAMotion, AreJoinedWhereTheyAreMany) {
  for (int i = 0; i < 50; ++i) motion.col(200 * i).array() += 0.1F;
  const auto messages = stream.advance(Source(2, motion));
  EXPECT_LE(messages.size(), 4u);
  put(messages);
  EXPECT_EQ(held(), motion);
}

TEST_F(ChangesOfAMotion, FramesThatCameEarlyComeAgain) {
  // As the first iterate has them; the result has them where they were.
  Eigen::MatrixXf guess = motion.middleCols(300, 40);
  guess.array() += 0.2F;
  const auto early = stream.show_early(Source(0, guess, "b", 300));
  EXPECT_EQ(ranges_of(early), (Ranges{{300, 40}}));
  EXPECT_TRUE(early[0].changes().early());
  put(early);
  EXPECT_EQ(last, Outcome::kPart);
  EXPECT_EQ(held().middleCols(300, 40), guess);
  EXPECT_EQ(client.sequence(), 1u);
  put(stream.advance(Source(2, motion)));
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(held(), motion);
}

TEST_F(ChangesOfAMotion, AreAllOfItInAnotherBasis) {
  EXPECT_TRUE(stream.show_early(Source(0, motion.leftCols(3), "another")).empty());
  Eigen::MatrixXf wider = Eigen::MatrixXf::Ones(5, kFrames);
  const auto messages = stream.advance(Source(2, wider, "another"));
  EXPECT_EQ(messages[0].changes().base_sequence(), 0u);
  put(messages);
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(client.basis_hash(), "another");
  EXPECT_EQ(held(), wider);
}

TEST_F(ChangesOfAMotion, ThatAreNoNumbersAreSentToo) {
  motion(0, 77) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(ranges_of(stream.advance(Source(2, motion))).size(), 1u);
}

TEST_F(ChangesOfAMotion, WhoJoinsBetweenTwoRangesAsksForAllOfIt) {
  motion.middleCols(1'000, 10).array() += 0.01F;
  motion.middleCols(4'000, 10).array() += 0.5F;
  const auto messages = stream.advance(Source(2, motion));
  ASSERT_EQ(messages.size(), 2u);
  MotionBuffer joined;
  EXPECT_EQ(joined.put(messages[1]), Outcome::kLost);
  joined.begin(Source(2, motion).encode(proto::ENCODING_COORDINATES, {0, kFrames}));
  EXPECT_EQ(joined.put(messages[1]), Outcome::kIgnored) << "it has them";
  motion.col(3).array() += 1.0F;
  for (const proto::Frames& frames : stream.advance(Source(3, motion)))
    EXPECT_EQ(joined.put(frames), Outcome::kWhole);
  EXPECT_EQ(Eigen::Map<const Eigen::MatrixXd>(joined.coordinates().data(), 3, kFrames),
            motion.cast<double>());
}

TEST_F(ChangesOfAMotion, WhoMissesAResultAsksForAllOfIt) {
  motion.col(10).array() += 1.0F;
  static_cast<void>(stream.advance(Source(2, motion)));
  motion.col(20).array() += 1.0F;
  EXPECT_EQ(client.put(stream.advance(Source(3, motion))[0]), Outcome::kLost);
}

TEST_F(ChangesOfAMotion, WhoMissesAnyMessageOfAResultAsksForAllOfIt) {
  motion.middleCols(1'000, 10).array() += 0.01F;
  motion.middleCols(4'000, 10).array() += 0.5F;
  motion.middleCols(8'000, 10).array() += 0.1F;
  const auto messages = stream.advance(Source(2, motion));
  ASSERT_EQ(messages.size(), 3u);
  MotionBuffer without_first = client, without_second = client;
  EXPECT_EQ(without_first.put(messages[1]), Outcome::kLost);
  EXPECT_EQ(without_second.put(messages[0]), Outcome::kPart);
  EXPECT_EQ(without_second.put(messages[2]), Outcome::kLost);
}

/// One that joins has all of it sent again; who holds it ignores that.
TEST_F(ChangesOfAMotion, FramesThatCameEarlyComeAgainWhereOneJoinsMeanwhile) {
  Eigen::MatrixXf guess = motion.middleCols(300, 40);
  guess.array() += 0.2F;
  put(stream.show_early(Source(0, guess, "b", 300)));
  put(stream.begin(Source(1, motion)));
  EXPECT_EQ(last, Outcome::kIgnored);
  put(stream.advance(Source(2, motion)));
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(held(), motion);
}

TEST_F(ChangesOfAMotion, LongOnesComeInChunks) {
  ChangeStream chunked(1'000 * 12);
  const auto messages = chunked.advance(Source(1, motion));
  EXPECT_EQ(messages.size(), 10u);
  MotionBuffer other;
  for (const proto::Frames& frames : messages) last = other.put(frames);
  EXPECT_EQ(last, Outcome::kWhole);
  EXPECT_EQ(Eigen::Map<const Eigen::MatrixXd>(other.coordinates().data(), 3, kFrames),
            motion.cast<double>());
}

TEST_F(ChangesOfAMotion, BeginAnewOnceNobodyHoldsThem) {
  stream.forget();
  EXPECT_TRUE(stream.show_early(Source(0, motion.leftCols(3))).empty());
  const auto messages = stream.advance(Source(2, motion));
  EXPECT_EQ(messages[0].changes().base_sequence(), 0u);
  EXPECT_EQ(messages[0].frame_count(), 10'000u);
  EXPECT_TRUE(stream.advance(Source(2, motion)).empty()) << "known already";
}

TEST(MotionBufferOfAServerThatLies, IsRefused) {
  const Eigen::MatrixXf motion = motion_of(10);
  MotionBuffer buffer;
  proto::Frames frames = ChangeStream(kChunk).advance(Source(1, motion))[0];
  frames.mutable_changes()->set_motion_frames(5);
  EXPECT_ANY_THROW(buffer.put(frames)) << "more than the motion has";
  frames.mutable_changes()->set_motion_frames(4'000'000'000);
  frames.mutable_data()->set_shape(1, 4'000'000'000);
  EXPECT_ANY_THROW(buffer.put(frames)) << "beyond memory";
  frames.clear_data();
  EXPECT_ANY_THROW(buffer.put(frames));
}

}  // namespace
}  // namespace limber::server
