#include "engine/session/core/keyed_items.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/base/random.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

struct Item {
  int key = 0, value = 0;
  bool operator==(const Item&) const = default;
};

TEST(KeyedItems, AgreeWithAVectorThatIsSearched) {
  Random random(3);
  for (int run = 0; run < 50; ++run) {
    std::vector<Item> naive;
    for (int i = 0; i < test::below(random, 6); ++i) naive.push_back({test::below(random, 5), i});
    KeyedItems<Item, int> items(naive, &Item::key);
    for (int step = 0; step < 60; ++step) {
      const int key = test::below(random, 5);
      const auto has_key = [key](const Item& item) { return item.key == key; };
      const auto first = std::find_if(naive.begin(), naive.end(), has_key);
      switch (test::below(random, 4)) {
        case 0:
          naive.push_back({key, 100 + step});
          items.push_back({key, 100 + step});
          break;
        case 1:
          EXPECT_EQ(items.erase_first(key), first != naive.end());
          if (first != naive.end()) naive.erase(first);
          break;
        case 2:
          EXPECT_EQ(items.erase_all(key), std::erase_if(naive, has_key));
          break;
        default:
          ASSERT_EQ(items.find(key) == nullptr, first == naive.end());
          if (first != naive.end()) items.find(key)->value = first->value += 1000;
      }
      ASSERT_EQ(items.list(), naive) << run << " " << step;
      ASSERT_EQ(items.size(), naive.size());
    }
  }
}

}  // namespace
}  // namespace limber::session
