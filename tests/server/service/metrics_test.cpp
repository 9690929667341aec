#include "server/service/metrics.h"

#include <gmock/gmock.h>

#include "server/transport/latencies.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace proto = limber::v1;

TEST(Metrics, SessionsAreCountedByKindAndStateWithoutTheirNames) {
  proto::GetServerInfoResponse info;
  for (const char* state : {"ready", "ready", "parked"}) {
    auto& session = *info.mutable_status()->add_sessions();
    session.set_session("secret");
    session.set_kind("bodies");
    session.set_state(state);
    session.set_people(2);
  }
  const std::string text = metrics_text(info);
  EXPECT_THAT(text, HasSubstr("limber_sessions{kind=\"bodies\",state=\"ready\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("limber_sessions{kind=\"bodies\",state=\"parked\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("limber_session_clients 6\n"));
  EXPECT_THAT(text, Not(HasSubstr("secret")));
  EXPECT_THAT(text, Not(HasSubstr("limber_store")));
}

TEST(Metrics, ClassesOfAHistogramAreAddedUp) {
  proto::GetServerInfoResponse info;
  auto& latencies = *info.mutable_status()->mutable_acknowledgements();
  latencies.add_bounds_s(0.5);
  latencies.add_bounds_s(1);
  for (const std::uint64_t count : {3, 2, 1}) latencies.add_counts(count);
  latencies.set_sum_s(4);
  const std::string text = metrics_text(info), name = "limber_edit_acknowledgement_seconds";
  EXPECT_THAT(text, HasSubstr(name + "_bucket{le=\"0.5\"} 3\n"));
  EXPECT_THAT(text, HasSubstr(name + "_bucket{le=\"1\"} 5\n"));
  EXPECT_THAT(text, HasSubstr(name + "_bucket{le=\"+Inf\"} 6\n"));
  EXPECT_THAT(text, HasSubstr(name + "_count 6\n"));
  EXPECT_THAT(text, HasSubstr(name + "_sum 4\n"));
}

TEST(Metrics, LatenciesFallIntoClassesWithTheirUpperEnd) {
  using std::chrono::microseconds;
  Latencies latencies;
  latencies.note(microseconds(50));
  latencies.note(microseconds(51));
  latencies.note(std::chrono::seconds(11));
  latencies.note(microseconds(-3));  // of a clock that went back
  EXPECT_EQ(latencies.count(0), 2u);
  EXPECT_EQ(latencies.count(1), 1u);
  EXPECT_EQ(latencies.count(Latencies::kBounds.size()), 1u);
  EXPECT_DOUBLE_EQ(latencies.longest_s(), 11);
  EXPECT_NEAR(latencies.sum_s(), 11.000101, 1e-9);
}

}  // namespace
}  // namespace limber::server
