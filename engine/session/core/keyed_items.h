#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

namespace limber::session {

/// A list under edits that find its items by a member of theirs: as a vector that is searched, but
/// each edit takes the logarithm of its length.
template <class Item, class Key>
class KeyedItems {
 public:
  KeyedItems(std::vector<Item> items, Key Item::*key) : items_(std::move(items)), key_(key) {}

  [[nodiscard]] std::size_t size() const { return items_.size() - erased_; }

  /// The first with this key; null: there is none. Its key is not to be changed.
  [[nodiscard]] Item* find(Key key) {
    const auto found = first(key);
    return found == places_.end() ? nullptr : &items_[found->second];
  }
  void push_back(Item item) {
    if (is_indexed_) places_.emplace(item.*key_, items_.size());
    items_.push_back(std::move(item));
    is_erased_.push_back(0);
  }
  /// @returns whether there was one
  bool erase_first(Key key) {
    const auto found = first(key);
    if (found == places_.end()) return false;
    erase(found);
    return true;
  }
  /// @returns how many there were
  std::size_t erase_all(Key key) {
    auto [at, end] = places().equal_range(key);
    std::size_t count = 0;
    for (; at != end; ++count) at = erase(at);
    return count;
  }
  /// In the order in which they were put in.
  [[nodiscard]] std::vector<Item> list() const {
    std::vector<Item> left;
    left.reserve(size());
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (is_erased_[i] == 0) left.push_back(items_[i]);
    }
    return left;
  }

 private:
  using Places = std::multimap<Key, std::size_t>;  // equal keys in the order of their items

  typename Places::iterator first(Key key) {
    const auto found = places().lower_bound(key);
    return found != places_.end() && found->first == key ? found : places_.end();
  }
  typename Places::iterator erase(typename Places::iterator place) {
    is_erased_[place->second] = 1;
    ++erased_;
    return places_.erase(place);
  }
  /// Made when it is first needed: most requests look at few of the lists.
  Places& places() {
    if (std::exchange(is_indexed_, true)) return places_;
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (is_erased_[i] == 0) places_.emplace(items_[i].*key_, i);
    }
    return places_;
  }

  std::vector<Item> items_;
  Key Item::*key_;
  std::vector<char> is_erased_ = std::vector<char>(items_.size(), 0);  // of each of items_
  std::size_t erased_ = 0;
  bool is_indexed_ = false;
  Places places_;
};

}  // namespace limber::session
