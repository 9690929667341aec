#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace limber::session {

/// Shapes in order of arrival, thinned to every `stride`-th if there are too many: the retained
/// ones are spread evenly over all.
template <class Shape>
class ShapeCache {
 public:
  /// @param most  >= 0
  explicit ShapeCache(int most) : most_(static_cast<std::size_t>(most)) {}

  /// @param make  makes the shape, where it is kept
  template <class Make>
  void keep(const Make& make) {
    if (most_ == 0 || offered_++ % stride_ != 0) return;
    if (shapes_.size() == most_) {
      thin();
      if ((offered_ - 1) % stride_ != 0) return;
      if (shapes_.size() == most_) shapes_.pop_back();  // only where one is all that is kept
    }
    shapes_.emplace_back(make());
  }
  [[nodiscard]] std::vector<Shape> take() { return std::move(shapes_); }

 private:
  void thin() {
    std::vector<Shape> left;
    for (std::size_t i = 0; i < shapes_.size(); i += 2) left.push_back(std::move(shapes_[i]));
    shapes_ = std::move(left);
    stride_ *= 2;
  }

  std::size_t most_, offered_ = 0, stride_ = 1;
  std::vector<Shape> shapes_;
};

}  // namespace limber::session
