// Of long motions, what is looked at and what lies near an edit comes before all of it.
#include "engine/session/bodies/early_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using spacetime::FrameSpan;
using Spans = std::vector<std::pair<int, int>>;

Spans chosen(const std::vector<FrameSpan>& views, const std::vector<int>& edited, int frames) {
  Spans spans;
  for (const FrameSpan& span : choose_early_spans(views, edited, frames))
    spans.emplace_back(span.first, span.count);
  return spans;
}

TEST(EarlySpans, AreAroundEditsAndWhatIsLookedAt) {
  EXPECT_EQ(chosen({}, {}, 100'000), Spans{});
  EXPECT_EQ(chosen({}, {50'000}, 100'000), (Spans{{49'744, 513}}));
  EXPECT_EQ(chosen({}, {3}, 100'000), (Spans{{0, 260}})) << "cut at the first frame";
  EXPECT_EQ(chosen({}, {99'999}, 100'000), (Spans{{99'743, 257}})) << "and at the last";
  EXPECT_EQ(chosen({{90'000, 100}}, {50'000}, 100'000), (Spans{{49'744, 513}, {90'000, 100}}));
}

TEST(EarlySpans, DoNotOverlap) {
  EXPECT_EQ(chosen({{1'000, 100}, {1'050, 100}}, {1'000, 1'010}, 100'000), (Spans{{744, 523}}));
}

TEST(EarlySpans, AreNotMoreThanAFewMilliseconds) {
  std::vector<int> edited(400);
  for (int i = 0; i < 400; ++i) edited[static_cast<std::size_t>(i)] = 200 * i;
  int frames = 0;
  for (const auto& [first, count] : chosen({{0, 100'000}, {70'000, 100}}, edited, 100'000))
    frames += count;
  EXPECT_EQ(frames, kEarlyFrames);
  // Half of them are for edits.
  EXPECT_EQ(chosen({{0, 100'000}}, {50'000}, 100'000),
            (Spans{{0, kEarlyFrames / 2}, {49'744, 513}}));
}

/// Keeps early frames, with how many results had come before.
class EarlyRecorder final : public test::Recorder {
 public:
  bool wants_early_frames() override { return is_watched; }
  void on_early_frames(const std::vector<std::shared_ptr<const BodyResult>>& early) override {
    before = results().size();
    parts.insert(parts.end(), early.begin(), early.end());
  }
  std::atomic<bool> is_watched{true};
  std::vector<std::shared_ptr<const BodyResult>> parts;
  std::size_t before = 0;
};

scene::Scene long_bar(int frames) {
  scene::Scene scene = test::bent_bar();
  scene.frame_count = frames;
  for (int i = 0; i < 2; ++i)
    scene.constraints[static_cast<std::size_t>(i)].frame = frames / 4 * (1 + 2 * i);
  return scene;
}

struct LongSession {
  explicit LongSession(int frames)
      : session("long", long_bar(frames), {}, test::shared_cache(), pool.executor(), recorder) {
    recorder->wait_checked(0);  // no result of it comes after that
    recorder->parts.clear();
  }
  std::shared_ptr<EarlyRecorder> recorder = std::make_shared<EarlyRecorder>();
  test::Pool pool{1};
  BodySession session;
};

TEST(EarlyFrames, AreThoseOfTheFirstResult) {
  LongSession live(12'000);
  live.session.look_at({11'000, 64});
  const scene::Constraint moved = live.session.constraints()[0];
  const std::size_t before = live.recorder->results().size();
  const auto receipt = live.session.edit({MoveConstraint{moved.id, {0.02, -0.2, 0.05}}});
  ASSERT_TRUE(live.recorder->wait_final(receipt.revision));
  const auto& parts = live.recorder->parts;
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0]->first_frame, 3'000 - 256);
  EXPECT_EQ(parts[0]->coordinates.cols(), 513);
  EXPECT_EQ(parts[1]->first_frame, 11'000);
  EXPECT_EQ(parts[1]->coordinates.cols(), 64);
  const auto first = live.recorder->results()[before];
  EXPECT_EQ(first->revision, receipt.revision);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_LE(live.recorder->before, before) << "before the first result";
    EXPECT_EQ(parts[i]->revision, receipt.revision);
    EXPECT_EQ(parts[i]->sequence, 0u) << "of no result";
    EXPECT_FALSE(parts[i]->is_final);
    EXPECT_EQ(parts[i]->shown, first->shown);
    EXPECT_EQ(parts[i]->report.total_energy, first->report.total_energy);
    // But for the order in which products are summed.
    const Eigen::MatrixXf difference =
        parts[i]->coordinates -
        first->coordinates.middleCols(parts[i]->first_frame, parts[i]->coordinates.cols());
    EXPECT_LE(difference.cwiseAbs().maxCoeff(), 1e-6 * first->coordinates.cwiseAbs().maxCoeff());
  }
}

/// "Equal to the cold solve to 1e-6", for both maps.
TEST(EarlyFrames, AnEditOfALongMotionEndsWhereAFreshSessionDoes) {
  for (const Exactness exactness : {Exactness::kReduced, Exactness::kFull}) {
    SessionOptions options;
    options.exactness = exactness;
    test::Live edited(long_bar(20'000), options);
    ASSERT_TRUE(edited.recorder->wait_final(0));
    std::shared_ptr<const BodyResult> warm;
    for (int i = 1; i <= 3; ++i) {
      const scene::Constraint moved = edited.session.constraints()[0];
      warm = edited.edit({MoveConstraint{moved.id, {0.01 * i, 0.1 - 0.05 * i, 0.05}}});
      ASSERT_TRUE(warm);
    }
    test::Live fresh(edited.session.scene(), options);
    const auto cold = fresh.recorder->wait_final(0);
    ASSERT_TRUE(cold);
    EXPECT_EQ(warm->is_exact, exactness == Exactness::kFull);
    EXPECT_LE((warm->modal - cold->modal).cwiseAbs().maxCoeff(),
              1e-6 * cold->modal.cwiseAbs().maxCoeff());
    EXPECT_NEAR(warm->report.total_energy, cold->report.total_energy,
                1e-9 * cold->report.total_energy);
  }
}

TEST(EarlyFrames, AreThoseAroundWhatWasRemovedToo) {
  LongSession live(12'000);
  const auto receipt = live.session.edit({RemoveConstraint{live.session.constraints()[1].id}});
  ASSERT_TRUE(live.recorder->wait_final(receipt.revision));
  ASSERT_EQ(live.recorder->parts.size(), 1u);
  EXPECT_EQ(live.recorder->parts[0]->first_frame, 9'000 - 256);
}

TEST(EarlyFrames, AreNotComputedForNobody) {
  LongSession live(12'000);
  live.recorder->is_watched = false;
  const auto receipt =
      live.session.edit({MoveConstraint{live.session.constraints()[0].id, {0.02, -0.2, 0.05}}});
  ASSERT_TRUE(live.recorder->wait_final(receipt.revision));
  EXPECT_TRUE(live.recorder->parts.empty());
}

TEST(EarlyFrames, AreNotSentOfShortMotions) {
  LongSession live(2'000);
  const auto receipt =
      live.session.edit({MoveConstraint{live.session.constraints()[0].id, {0.02, -0.2, 0.05}}});
  ASSERT_TRUE(live.recorder->wait_final(receipt.revision));
  EXPECT_TRUE(live.recorder->parts.empty());
}

TEST(EarlyFrames, LookingBeyondTheMotionIsRefused) {
  LongSession live(200);
  const auto refused_field = [&](FrameSpan frames) -> std::string {
    try {
      live.session.look_at(frames);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kOutOfRange);
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(refused_field({200, 1}), "first_frame");
  EXPECT_EQ(refused_field({-1, 1}), "first_frame");
  EXPECT_EQ(refused_field({199, 2}), "frame_count");
  EXPECT_EQ(refused_field({0, 0}), "frame_count");
  EXPECT_EQ(refused_field({199, 1}), "none");
}

}  // namespace
}  // namespace limber::session
