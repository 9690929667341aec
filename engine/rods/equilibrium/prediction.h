#pragma once

#include <Eigen/Core>
#include <vector>

namespace limber::rods::detail {

/// Increments over the last steps, from which the next one is extrapolated by Newton's divided
/// differences.
class Prediction {
 public:
  void clear() { past_.clear(); }
  void add(double length, const Eigen::VectorXd& increment) {
    past_.insert(past_.begin(), {length, increment});
    if (past_.size() > kPast) past_.pop_back();
  }
  [[nodiscard]] bool possible() const { return !past_.empty(); }
  [[nodiscard]] bool full() const { return past_.size() == kPast; }
  [[nodiscard]] Eigen::VectorXd over(double length) const {
    // Row k holds differences of order k + 1, over the k + 1 latest steps and those before.
    std::vector<Eigen::VectorXd> row;
    for (const Past& past : past_) row.push_back(past.increment / past.length);
    Eigen::VectorXd result = length * row[0];
    double weight = length;
    double behind = 0;
    for (std::size_t order = 1; order < past_.size(); ++order) {
      behind += past_[order - 1].length;
      weight *= length + behind;
      for (std::size_t i = 0; i + order < past_.size(); ++i) {
        double span = 0;
        for (std::size_t k = i; k <= i + order; ++k) span += past_[k].length;
        row[i] = (row[i] - row[i + 1]) / span;
      }
      result += weight * row[0];
    }
    return result;
  }

 private:
  static constexpr std::size_t kPast = 3;
  struct Past {
    double length;
    Eigen::VectorXd increment;
  };
  std::vector<Past> past_;  // the latest first
};

}  // namespace limber::rods::detail
