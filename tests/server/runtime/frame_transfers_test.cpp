#include "server/runtime/frame_transfers.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "engine/base/error.h"

namespace limber::server {
namespace {

using Clock = FrameTransfers::Clock;
using Without = FrameTransfers::WithoutRoom;

struct Made {
  std::uint64_t sequence = 0, revision = 0;
  bool is_final = true;
  std::string basis = "b";
};

/// A result of ten bytes.
class Numbered final : public FrameSource {
 public:
  explicit Numbered(Made made) : made_(std::move(made)) {}
  [[nodiscard]] std::uint64_t sequence() const override { return made_.sequence; }
  [[nodiscard]] int frame_count() const override { return 1; }
  [[nodiscard]] std::uint64_t revision() const override { return made_.revision; }
  [[nodiscard]] bool is_final() const override { return made_.is_final; }
  [[nodiscard]] std::uint64_t kept_bytes() const override { return 10; }
  [[nodiscard]] std::uint64_t basis_bytes() const override { return 100; }
  [[nodiscard]] std::string basis_hash() const override { return made_.basis; }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding, int) const override { return 1; }
  [[nodiscard]] proto::Frames encode(proto::Encoding, FrameRange) const override { return {}; }

 private:
  const Made made_;
};

struct Transfers : ::testing::Test {
  /// @returns the sequence of the result that the parts are of; 0: none has begun
  std::uint64_t begin(const Made& made, Without without = Without::kBeginNone) {
    const auto begun = transfers.begin(std::make_shared<const Numbered>(made), without, now);
    return begun ? begun->sequence() : 0;
  }
  std::uint64_t begin(std::uint64_t sequence, Without without = Without::kBeginNone) {
    return begin(Made{sequence}, without);
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
  FrameTransfers transfers{50};
  Clock::time_point now{};
};

Made iterate(std::uint64_t sequence, std::uint64_t revision) { return {sequence, revision, false}; }

TEST_F(Transfers, ALastPartEndsNobodysTransfer) {
  EXPECT_FALSE(has(1));
  EXPECT_EQ(begin(1), 1u);
  EXPECT_EQ(begin(1), 1u);
  for (int i = 0; i < 3; ++i) transfers.note_last(1);
  EXPECT_TRUE(has(1));
  transfers.note_last(7);  // of none
}

TEST_F(Transfers, ThatAreFetchedAreNotDisplaced) {
  for (std::uint64_t i = 1; i <= 5; ++i) EXPECT_EQ(begin(i), i);
  EXPECT_EQ(transfers.bytes(), 50u);
  EXPECT_EQ(begin(6), 0u);
  transfers.note_last(2);
  EXPECT_EQ(begin(7), 7u);
  EXPECT_FALSE(has(2));
  for (const std::uint64_t other : {1, 3, 4, 5, 7}) EXPECT_TRUE(has(other)) << other;
}

TEST_F(Transfers, OfWhatHasNoOtherWayDisplaceTheOneAskedForLongestAgo) {
  for (std::uint64_t i = 1; i <= 5; ++i) EXPECT_EQ(begin(i), i);
  EXPECT_TRUE(has(1));
  EXPECT_EQ(begin(6, Without::kDisplace), 6u);
  EXPECT_FALSE(has(2));
  EXPECT_TRUE(has(1));
}

TEST_F(Transfers, WithoutRoomShareAnIterateOfTheSameRevision) {
  EXPECT_EQ(begin(iterate(1, 4)), 1u);
  EXPECT_EQ(begin(iterate(2, 4)), 2u);
  EXPECT_EQ(begin(iterate(3, 4)), 3u);
  EXPECT_EQ(begin(iterate(4, 5)), 4u);
  EXPECT_EQ(begin(Made{5, 5}), 5u);
  EXPECT_EQ(begin(iterate(6, 4)), 3u) << "the one that was begun last";
  EXPECT_EQ(begin(iterate(7, 5)), 4u) << "not the final one: it is of an earlier solve";
  EXPECT_EQ(begin(iterate(8, 6)), 0u) << "others lack its edits";
  EXPECT_EQ(begin(Made{9, 4}), 0u) << "who waits for the end gets it";
}

TEST_F(Transfers, OneResultAlwaysHasRoom) {
  FrameTransfers small(1);
  const auto first = std::make_shared<const Numbered>(Made{1});
  const auto second = std::make_shared<const Numbered>(Made{2});
  EXPECT_EQ(small.begin(first, Without::kBeginNone, now), first);
  EXPECT_EQ(small.begin(second, Without::kBeginNone, now), nullptr);
  EXPECT_EQ(small.begin(second, Without::kDisplace, now), second);
  EXPECT_EQ(small.bytes(), 10u);
}

TEST_F(Transfers, CountEachBasisOnceButForTheNewest) {
  FrameTransfers large;
  for (const Made& made :
       {Made{1, 0, true, "a"}, Made{2, 0, true, "a"}, Made{3, 0, true, "b"}, Made{4, 0, true, "c"}})
    (void)large.begin(std::make_shared<const Numbered>(made), Without::kBeginNone, now);
  EXPECT_EQ(large.bytes(), 240u);
  EXPECT_EQ(large.find_basis("a", now)->sequence(), 2u);
  EXPECT_EQ(large.find_basis("d", now), nullptr);
}

TEST_F(Transfers, ThatNobodyContinuesGoWithTheSweep) {
  EXPECT_EQ(begin(1), 1u);
  EXPECT_EQ(begin(2), 2u);
  EXPECT_EQ(begin(3), 3u);
  transfers.note_last(3);
  now += FrameTransfers::kPatienceBehindLast;
  EXPECT_FALSE(transfers.sweep(now));
  now += std::chrono::seconds(1);
  EXPECT_TRUE(transfers.sweep(now));
  EXPECT_FALSE(has(3));
  EXPECT_TRUE(has(2));
  now = Clock::time_point{} + FrameTransfers::kPatience + std::chrono::seconds(1);
  EXPECT_TRUE(transfers.sweep(now));
  EXPECT_FALSE(has(1));
  EXPECT_TRUE(has(2));
  EXPECT_EQ(transfers.bytes(), 10u);
}

TEST_F(Transfers, ABasisThatIsAskedForStays) {
  EXPECT_EQ(begin(1), 1u);
  now += FrameTransfers::kPatience;
  EXPECT_NE(transfers.find_basis("b", now), nullptr);
  now += FrameTransfers::kPatience;
  EXPECT_FALSE(transfers.sweep(now));
  EXPECT_TRUE(has(1));
}

}  // namespace
}  // namespace limber::server
