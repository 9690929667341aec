#include "server/runtime/frame_transfers.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"

namespace limber::server {
namespace {

using Clock = FrameTransfers::Clock;

class Numbered final : public FrameSource {
 public:
  explicit Numbered(std::uint64_t sequence) : sequence_(sequence) {}
  [[nodiscard]] std::uint64_t sequence() const override { return sequence_; }
  [[nodiscard]] int frame_count() const override { return 1; }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding, int) const override { return 1; }
  [[nodiscard]] proto::Frames encode(proto::Encoding, FrameRange) const override { return {}; }

 private:
  const std::uint64_t sequence_;
};

struct Transfers : ::testing::Test {
  void begin(std::uint64_t sequence) {
    transfers.begin(std::make_shared<const Numbered>(sequence), now);
  }
  bool has(std::uint64_t sequence) {
    try {
      return transfers.find(sequence, now)->sequence() == sequence;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
      EXPECT_EQ(error.field(), "result_sequence");
      return false;
    }
  }
  FrameTransfers transfers;
  Clock::time_point now{};
};

TEST_F(Transfers, KeepAResultUntilAllThatBeganHaveEnded) {
  EXPECT_FALSE(has(1));
  begin(1);
  begin(2);
  begin(1);
  transfers.end(1);
  EXPECT_TRUE(has(1));
  transfers.end(1);
  EXPECT_FALSE(has(1));
  EXPECT_TRUE(has(2));
  transfers.end(7);  // of none
}

TEST_F(Transfers, KeepThoseThatWereAskedForLast) {
  for (std::uint64_t i = 1; i <= FrameTransfers::kMostResults; ++i) begin(i);
  EXPECT_TRUE(has(1));
  begin(100);
  EXPECT_TRUE(has(1));
  EXPECT_FALSE(has(2));
  EXPECT_TRUE(has(3));
}

TEST_F(Transfers, ForgetThoseThatNobodyContinues) {
  begin(1);
  begin(2);
  now += FrameTransfers::kPatience;
  EXPECT_TRUE(has(2));
  now += std::chrono::seconds(1);
  begin(3);
  EXPECT_FALSE(has(1));
  EXPECT_TRUE(has(2));
}

}  // namespace
}  // namespace limber::server
