#include "clients/cpp/event_queue.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace limber::client {
namespace {

using std::chrono::milliseconds;

StreamEvent event(const std::string& topic, std::uint64_t sequence, std::uint64_t missed = 0) {
  StreamEvent made{topic, {}, missed};
  made.message.set_sequence(sequence);
  return made;
}

TEST(EventQueue, KeepsTheNewestOfEachTopicInTheOrderOfArrival) {
  EventQueue queue(2);
  queue.push(event("status", 1));
  for (std::uint64_t i = 1; i <= 5; ++i) queue.push(event("frames", i, i == 3 ? 4 : 0));
  queue.push(event("status", 2));
  std::vector<std::pair<std::string, std::uint64_t>> read;
  std::uint64_t missed = 0;
  while (const auto next = queue.pop(milliseconds{0})) {
    read.emplace_back(next->topic, next->message.sequence());
    missed += next->missed;
    if (read.size() == 2) {
      EXPECT_EQ(next->missed, 3U + 4U) << "three dropped, and the four lost before one of them";
    }
  }
  EXPECT_EQ(read, (std::vector<std::pair<std::string, std::uint64_t>>{
                      {"status", 1}, {"frames", 4}, {"frames", 5}, {"status", 2}}));
  EXPECT_EQ(missed, 7U);
}

TEST(EventQueue, WakesWhoWaits) {
  EventQueue queue(1);
  std::thread later([&] {
    std::this_thread::sleep_for(milliseconds{50});
    queue.push(event("a", 1));
  });
  EXPECT_TRUE(queue.pop(milliseconds{20000}).has_value());
  later.join();
  EXPECT_FALSE(queue.pop(milliseconds{1}).has_value());
}

}  // namespace
}  // namespace limber::client
