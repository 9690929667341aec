#include "server/runtime/newest_first.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace limber::server {
namespace {

class Newest : public ::testing::Test {
 protected:
  NewestFirst::Task task(char name) {
    return [this, name] { ran += name; };
  }

  NewestFirst tasks;
  std::string ran;
};

TEST_F(Newest, FirstButEveryFourthTimeTheOldest) {
  std::vector<std::shared_ptr<NewestFirst::Place>> places;
  for (const char name : std::string("abcdefgh")) {
    places.push_back(NewestFirst::place());
    tasks.put(places.back(), task(name));
  }
  for (int i = 0; i < 10; ++i) tasks.run_one();
  EXPECT_EQ(ran, "hgfaedcb");
}

/// A thread was interrupted between deciding on a task and putting it.
TEST_F(Newest, IsNotLostToAnOlderOneThatComesLate) {
  const auto first = NewestFirst::place(), second = NewestFirst::place();
  tasks.put(first, task('a'));
  tasks.put(second, task('b'));
  tasks.put(first, task('c'));
  for (int i = 0; i < 4; ++i) tasks.run_one();
  EXPECT_EQ(ran, "cba");
}

TEST_F(Newest, IsNotRunOnceWithdrawn) {
  const auto place = NewestFirst::place();
  tasks.withdraw(place);
  tasks.put(place, task('a'));
  tasks.put(place, task('a'));
  tasks.withdraw(place);
  tasks.run_one();
  EXPECT_EQ(ran, "");
  tasks.put(place, task('b'));
  tasks.run_one();
  EXPECT_EQ(ran, "b");
}

TEST_F(Newest, MayPutItselfAgain) {
  const auto place = NewestFirst::place();
  tasks.put(place, [&] {
    ran += 'a';
    tasks.put(place, task('b'));
  });
  tasks.run_one();
  EXPECT_EQ(ran, "a");
  tasks.run_one();
  EXPECT_EQ(ran, "ab");
}

TEST(NewestFirst, LetsGoWhatWaitsAtItsEnd) {
  const auto held = std::make_shared<int>(1);
  const auto place = NewestFirst::place();
  {
    NewestFirst tasks;
    tasks.put(place, [held, place] {});
    EXPECT_EQ(held.use_count(), 2);
  }
  EXPECT_EQ(held.use_count(), 1);
}

}  // namespace
}  // namespace limber::server
