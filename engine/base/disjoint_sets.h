#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace limber {

/// Items 0, 1, .. in sets, each item at first in one of its own.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// The lowest item of the set that `item` is in.
  [[nodiscard]] int lowest(int item) {
    while (parent(item) != item) {
      // Halving paths keeps later searches short.
      parent(item) = parent(parent(item));
      item = parent(item);
    }
    return item;
  }

  /// Makes one set of those that a and b are in.
  void join(int a, int b) {
    const auto [low, high] = std::minmax({lowest(a), lowest(b)});
    parent(high) = low;
  }

 private:
  int& parent(int item) { return parent_[static_cast<std::size_t>(item)]; }
  std::vector<int> parent_;
};

}  // namespace limber
