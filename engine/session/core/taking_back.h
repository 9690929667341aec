#pragma once

#include <algorithm>
#include <functional>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/session/core/step_notes.h"

namespace limber::session {

/// Takes one step back out of the current value although others came after it. Each value that the
/// step changed is reset, unless another author has changed it since.
class TakingBack {
 public:
  /// @param since  author of the later edits, for messages
  explicit TakingBack(Author since) : since_(std::move(since)) {}

  /// @param what  for messages: "gravity"
  /// @throws Error{kFailedPrecondition} where it was changed since
  template <class Value, class Equal = std::equal_to<>>
  void value(Value& now, const Value& before, const Value& after, const std::string& what,
             const Equal& equal = {}) const {
    if (equal(before, after)) return;
    if (!equal(now, after)) refuse_to_take_back(what, since_);
    now = before;
  }

  /// The same of each key of a list; several items may have one key.
  /// @param what  of a key, for messages
  template <class Item, class Key, class What>
  void list(std::vector<Item>& now, const std::vector<Item>& before, const std::vector<Item>& after,
            Key Item::*key, const What& what) const {
    std::set<Key> keys;
    for (const auto* items : {&before, &after})
      for (const Item& item : *items) keys.insert(item.*key);
    for (const Key& one : keys) {
      const auto had = of_key(before, key, one), got = of_key(after, key, one);
      if (had == got) continue;
      if (of_key(now, key, one) != got) refuse_to_take_back(what(one), since_);
      std::erase_if(now, [&](const Item& item) { return item.*key == one; });
      now.insert(now.end(), had.begin(), had.end());
    }
  }

 private:
  template <class Item, class Key>
  static std::vector<Item> of_key(const std::vector<Item>& items, Key Item::*key, const Key& one) {
    std::vector<Item> found;
    std::copy_if(items.begin(), items.end(), std::back_inserter(found),
                 [&](const Item& item) { return item.*key == one; });
    return found;
  }

  const Author since_;
};

}  // namespace limber::session
