#include "engine/session/bodies/constraint_rules.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using test::held;
using test::two_tets;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Field and code of a refusal; "accepted" where there is none.
std::string ruling(const std::function<void()>& check) {
  try {
    check();
  } catch (const Error& error) {
    return error.field() + " " + to_string(error.code());
  }
  return "accepted";
}

const std::string kInvalid = to_string(ErrorCode::kInvalidArgument);
const std::string kRange = to_string(ErrorCode::kOutOfRange);

TEST(ConstraintRules, Frames) {
  const ConstraintRules rules(two_tets());
  EXPECT_EQ(ruling([&] { rules.check_frame(0); }), "accepted");
  EXPECT_EQ(ruling([&] { rules.check_frame(9); }), "accepted");
  EXPECT_EQ(ruling([&] { rules.check_frame(10); }), "frame " + kRange);
  EXPECT_EQ(ruling([&] { rules.check_frame(-1); }), "frame " + kRange);
}

TEST(ConstraintRules, NodesThatDoNotMoveOrComeTwiceAreNamedByPlace) {
  const ConstraintRules rules(two_tets());
  const auto of = [&](const std::vector<int>& nodes) {
    scene::Constraint group;
    group.nodes = nodes;
    return ruling([&] { rules.check_place(group); });
  };
  EXPECT_EQ(of({4, 0, 3}), "accepted");
  EXPECT_EQ(of({}), "nodes " + kInvalid);
  EXPECT_EQ(of({1, 6}), "nodes[1] " + kRange);
  EXPECT_EQ(of({-1}), "nodes[0] " + kRange);
  EXPECT_EQ(of({1, 5}), "nodes[1] " + kInvalid);  // in no tet
  EXPECT_EQ(of({3, 1, 2, 3}), "nodes[3] " + kInvalid);
  EXPECT_EQ(of({2, 2}), "nodes[1] " + kInvalid);
}

TEST(ConstraintRules, AxesAndWeights) {
  for (unsigned axes = 1; axes <= 7; ++axes)
    EXPECT_EQ(ruling([&] { ConstraintRules::check_axes(axes); }), "accepted");
  EXPECT_EQ(ruling([] { ConstraintRules::check_axes(0); }), "axes " + kInvalid);
  EXPECT_EQ(ruling([] { ConstraintRules::check_axes(8); }), "axes " + kInvalid);
  const auto weight = [](double value) {
    return ruling([&] { ConstraintRules::check_weight(value); });
  };
  EXPECT_EQ(weight(100), "accepted");
  EXPECT_EQ(weight(ConstraintRules::kLeastWeight), "accepted");
  EXPECT_EQ(weight(scene::kGreatestWeight), "accepted");
  EXPECT_EQ(weight(test::kInfinity), "accepted");  // exact
  EXPECT_EQ(weight(1e-31), "weight " + kRange);
  EXPECT_EQ(weight(1.1e12), "weight " + kRange);
  EXPECT_EQ(weight(0), "weight " + kInvalid);
  EXPECT_EQ(weight(-1), "weight " + kInvalid);
  EXPECT_EQ(weight(-test::kInfinity), "weight " + kInvalid);
  EXPECT_EQ(weight(kNaN), "weight " + kInvalid);
}

/// Two tets are two long; the unused node 5 does not make them longer.
TEST(ConstraintRules, TargetsMayBeAMillionBodyLengthsAway) {
  scene::Scene scene = two_tets();
  const ConstraintRules rules(scene);
  const auto of = [](const ConstraintRules& its, double z) {
    return ruling([&] { its.check_target({0, 1, z}); });
  };
  EXPECT_EQ(of(rules, 2e6), "accepted");
  EXPECT_EQ(of(rules, -2e6), "accepted");
  EXPECT_EQ(of(rules, 2.1e6), "target " + kRange);
  EXPECT_EQ(of(rules, -2.1e6), "target " + kRange);
  EXPECT_EQ(of(rules, kNaN), "target " + kInvalid);
  EXPECT_EQ(of(rules, test::kInfinity), "target " + kInvalid);
  scene.mesh.nodes.row(2).array() += 1e9;  // a body that is far from the origin
  const ConstraintRules far(scene);
  EXPECT_EQ(of(far, 1e9 + 2e6), "accepted");
  EXPECT_EQ(of(far, 1e9 + 2.1e6), "target " + kRange);
}

TEST(ConstraintRules, AWholeConstraintIsRefusedByItsFirstFault) {
  const ConstraintRules rules(two_tets());
  scene::Constraint constraint = held(3, 2, {0.1, 0, 0});
  EXPECT_EQ(ruling([&] { rules.check(constraint); }), "accepted");
  constraint.weight = 0;
  EXPECT_EQ(ruling([&] { rules.check(constraint); }), "weight " + kInvalid);
  constraint.kind = static_cast<scene::TargetKind>(17);
  EXPECT_EQ(ruling([&] { rules.check(constraint); }), "kind " + kInvalid);
  constraint.frame = 10;
  EXPECT_EQ(ruling([&] { rules.check(constraint); }), "frame " + kRange);
}

TEST(ConstraintRules, EndsMustLeaveAFrame) {
  using scene::End;
  scene::Scene scene = two_tets();
  const auto of = [&](int frames, End first, End last) {
    scene.frame_count = frames;
    const ConstraintRules rules(scene);
    return ruling([&] { rules.check_ends(first, last); });
  };
  EXPECT_EQ(of(5, End::kPinnedPositionVelocity, End::kPinnedPositionVelocity), "accepted");
  EXPECT_EQ(of(4, End::kPinnedPositionVelocity, End::kPinnedPositionVelocity),
            "last_end " + kInvalid);
  EXPECT_EQ(of(4, End::kPinnedPositionVelocity, End::kPinnedPosition), "accepted");
  EXPECT_EQ(of(10, static_cast<End>(9), End::kFree), "first_end " + kInvalid);
  EXPECT_EQ(of(10, End::kFree, static_cast<End>(9)), "last_end " + kInvalid);
}

TEST(ConstraintRules, Dynamics) {
  const auto of = [](double rate, double period, double damping) {
    scene::Dynamics dynamics;
    dynamics.frames_per_second = rate;
    dynamics.period_frames = period;
    dynamics.damping_ratio = damping;
    return ruling([&] { ConstraintRules::check_dynamics(dynamics); });
  };
  EXPECT_EQ(of(30, 0, 0), "accepted");
  EXPECT_EQ(of(1e-6, 1e9, std::nextafter(1.0, 0.0)), "accepted");
  EXPECT_EQ(of(0, 0, 0), "frames_per_second " + kInvalid);
  EXPECT_EQ(of(kNaN, 0, 0), "frames_per_second " + kInvalid);
  EXPECT_EQ(of(30, 1e-4, 0), "period_frames " + kInvalid);
  EXPECT_EQ(of(30, -1, 0), "period_frames " + kInvalid);
  EXPECT_EQ(of(30, kNaN, 0), "period_frames " + kInvalid);
  EXPECT_EQ(of(30, 0, 1), "damping_ratio " + kInvalid);
  EXPECT_EQ(of(30, 0, -0.01), "damping_ratio " + kInvalid);
}

TEST(ConstraintRules, WarningsSayWhatMovesNothing) {
  using scene::End;
  const ConstraintRules rules(two_tets());
  const auto fields = [&](const scene::Constraint& constraint, End first) {
    std::string all;
    for (const scene::Issue& issue : rules.warnings(constraint, first, End::kFree)) {
      EXPECT_EQ(issue.severity, scene::Issue::Severity::kWarning);
      all += issue.field + " ";
    }
    return all;
  };
  EXPECT_EQ(fields(held(5, 3), End::kPinnedPosition), "");
  EXPECT_EQ(fields(held(0, 3), End::kPinnedPosition), "frame ");
  EXPECT_EQ(fields(held(0, 3), End::kFree), "");
  EXPECT_EQ(fields(held(5, 2), End::kPinnedPosition), "nodes ");
  EXPECT_EQ(fields(held(1, 0), End::kPinnedPositionVelocity), "frame nodes ");
  scene::Constraint group = held(5, 0);
  group.nodes = {0, 1, 2};
  EXPECT_EQ(fields(group, End::kFree), "nodes ");
  group.nodes.push_back(4);
  EXPECT_EQ(fields(group, End::kFree), "");
}

}  // namespace
}  // namespace limber::session
