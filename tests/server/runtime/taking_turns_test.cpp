#include "server/runtime/taking_turns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "engine/base/lent_place.h"

namespace limber::server {
namespace {

class Turns : public ::testing::Test {
 protected:
  void put(const std::string& client, char name) {
    tasks.put(client, [this, name] { ran += name; });
  }

  static constexpr std::size_t kThreads = 10;
  TakingTurns tasks{kThreads};
  std::string ran;
};

TEST_F(Turns, AreTakenByClientsWhateverTheyHaveAskedFor) {
  for (const char name : std::string("ABCD")) put("many", name);
  put("one", '1');
  put("two", '2');
  put("two", '3');
  for (int i = 0; i < 9; ++i) tasks.run_one();
  EXPECT_EQ(ran, "A12B3CD");
}

TEST_F(Turns, OfAClientThatComesBackAreBehindTheOthers) {
  put("many", 'A');
  put("many", 'B');
  put("one", '1');
  tasks.run_one();
  tasks.run_one();
  put("one", '2');
  tasks.run_one();
  tasks.run_one();
  EXPECT_EQ(ran, "A1B2");
}

TEST_F(Turns, MayAskForOthers) {
  tasks.put("many", [this] { put("many", 'b'); });
  put("one", '1');
  for (int i = 0; i < 3; ++i) tasks.run_one();
  EXPECT_EQ(ran, "1b");
}

/// Tasks that run until another thread has taken its turn, and how many did so at once.
class LongTasks : public Turns {
 protected:
  void put_long(const std::string& client, TakingTurns::Share share) {
    const auto task = [this] {
      ++begun;
      most = std::max(most, ++running);
      tasks.run_one();
      --running;
    };
    for (std::size_t i = 0; i < kThreads; ++i) tasks.put(client, task, share);
  }

  std::size_t begun = 0, running = 0, most = 0;
};

TEST_F(LongTasks, LeaveThreadsToOtherClients) {
  put_long("many", TakingTurns::Share::kPart);
  tasks.run_one();
  EXPECT_EQ(most, kThreads / 2);
  EXPECT_EQ(begun, kThreads) << "those that were left run on threads that become free";
}

TEST_F(LongTasks, ArePassedByThoseOfOthers) {
  bool is_passed = false;
  put_long("many", TakingTurns::Share::kPart);
  tasks.put("last", [&] { is_passed = begun < kThreads; });
  tasks.run_one();
  EXPECT_TRUE(is_passed);
}

TEST_F(LongTasks, TakeAllThreadsWhereTheirNumberIsBoundedElsewhere) {
  put_long("jobs", TakingTurns::Share::kAll);
  tasks.run_one();
  EXPECT_EQ(most, kThreads);
}

TEST_F(LongTasks, LeaveAPlaceToWhatIsShorter) {
  for (const char* client : {"a", "b", "c", "d", "e", "f"})
    put_long(client, TakingTurns::Share::kPartButOne);
  bool is_passed = false;
  tasks.put("short", [&] { is_passed = running < kThreads && begun < kThreads; });
  tasks.run_one();
  EXPECT_LT(most, kThreads);
  EXPECT_TRUE(is_passed) << "though six clients have more to do than there are places";
}

TEST_F(LongTasks, GoOneAfterTheOtherWhereNobodyAskedForThem) {
  put_long("idle", TakingTurns::Share::kOne);
  tasks.run_one();
  EXPECT_EQ(most, 1);
}

TEST(TakingTurns, PlacesOfTasksThatWaitForSomebodyAreLent) {
  int asked = 0;
  std::string ran;
  TakingTurns tasks(2, [&] { ++asked; });
  tasks.put("many", [&] {
    tasks.put("many", [&] { ran += 'b'; });
    tasks.put("many", [&] { ran += 'c'; });
    tasks.run_one();
    EXPECT_EQ(ran, "") << "the other place is for others";
    EXPECT_EQ(asked, 0);
    {
      const LentPlace lent;
      EXPECT_EQ(asked, 1) << "for a thread that runs what was left";
      tasks.run_one();
      EXPECT_EQ(ran, "b");
    }
    tasks.run_one();
    EXPECT_EQ(ran, "b") << "it was taken back";
    ran += 'a';
  });
  tasks.run_one();
  EXPECT_EQ(ran, "bac");
}

TEST(TakingTurns, LetsGoWhatWaitsAtItsEnd) {
  const auto held = std::make_shared<int>(1);
  {
    TakingTurns tasks(1);
    tasks.put("", [held] {});
    tasks.put("", [held] {});
    EXPECT_EQ(held.use_count(), 3);
  }
  EXPECT_EQ(held.use_count(), 1);
}

}  // namespace
}  // namespace limber::server
