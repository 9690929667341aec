#include "server/runtime/taking_turns.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace limber::server {
namespace {

class Turns : public ::testing::Test {
 protected:
  void put(const std::string& client, char name) {
    tasks.put(client, [this, name] { ran += name; });
  }

  TakingTurns tasks;
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

TEST(TakingTurns, LetsGoWhatWaitsAtItsEnd) {
  const auto held = std::make_shared<int>(1);
  {
    TakingTurns tasks;
    tasks.put("", [held] {});
    tasks.put("", [held] {});
    EXPECT_EQ(held.use_count(), 3);
  }
  EXPECT_EQ(held.use_count(), 1);
}

}  // namespace
}  // namespace limber::server
