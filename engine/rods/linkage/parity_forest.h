#pragma once

#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace limber::rods::detail {

/// Items in sets, where each item is equal or opposite to each other of its set.
class ParityForest {
 public:
  explicit ParityForest(std::size_t items) : parents_(items), parities_(items, 0) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }

  struct Root {
    int item;
    int parity;  // of the requested item, against this one: 0 equal, 1 opposite
  };
  [[nodiscard]] Root root(int item) {
    int top = item, parity = 0;
    for (; parents_[top] != top; top = parents_[top]) parity ^= parities_[top];
    for (int left = parity; parents_[item] != top && item != top;) {  // shorter next time
      const int above = std::exchange(parents_[item], top);
      left ^= std::exchange(parities_[item], left);
      item = above;
    }
    return {top, parity};
  }

  /// @returns false, and nothing changes, where the items are known to be the other
  [[nodiscard]] bool join(int a, int b, int parity) {
    const Root of_a = root(a), of_b = root(b);
    if (of_a.item == of_b.item) return (of_a.parity ^ of_b.parity) == parity;
    parents_[of_b.item] = of_a.item;
    parities_[of_b.item] = of_a.parity ^ of_b.parity ^ parity;
    return true;
  }

 private:
  std::vector<int> parents_, parities_;
};

}  // namespace limber::rods::detail
