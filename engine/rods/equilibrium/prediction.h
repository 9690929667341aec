#pragma once

#include <Eigen/Core>
#include <vector>

namespace limber::rods::detail {

/// Places and velocities at the last steps, from which the next place is extrapolated: Newton's
/// divided differences with a node twice where its velocity is known (Hermite). In increments from
/// the latest place; the unknowns turn with the shape, which costs an order only where steps turn
/// by much.
class Prediction {
 public:
  explicit Prediction(std::size_t places) : places_(places) {}

  void clear() { past_.clear(); }
  /// @param left      from where the step has ended to where it should have; empty: nothing
  /// @param velocity  there, per length; empty: not known
  void add(double length, const Eigen::VectorXd& increment, Eigen::VectorXd left,
           Eigen::VectorXd velocity) {
    if (left.size() == 0) left = Eigen::VectorXd::Zero(increment.size());
    for (Place& place : past_) {
      place.time -= length;
      place.value -= increment;
    }
    past_.insert(past_.begin(), {0, std::move(left), std::move(velocity)});
    if (past_.size() > places_) past_.pop_back();
  }
  [[nodiscard]] bool possible() const { return past_.size() >= 2; }
  /// To first order.
  [[nodiscard]] Eigen::VectorXd straight(double length) const {
    const Place& now = past_[0];
    if (now.velocity.size() == 0) return now.value;
    return now.value + length * now.velocity;
  }

  [[nodiscard]] Eigen::VectorXd over(double length) const {
    std::vector<double> times;
    std::vector<Eigen::VectorXd> row;
    std::vector<const Eigen::VectorXd*> velocity;
    for (const Place& place : past_) {
      for (int copy = 0; copy < (place.velocity.size() > 0 ? 2 : 1); ++copy) {
        times.push_back(place.time);
        row.push_back(place.value);
        velocity.push_back(&place.velocity);
      }
    }
    Eigen::VectorXd result = row[0];
    double weight = 1;
    for (std::size_t order = 1; order < times.size(); ++order) {
      weight *= length - times[order - 1];
      for (std::size_t i = 0; i + order < times.size(); ++i) {
        const double span = times[i] - times[i + order];
        if (span == 0) {
          row[i] = *velocity[i];
        } else {
          row[i] = (row[i] - row[i + 1]) / span;
        }
      }
      result += weight * row[0];
    }
    return result;
  }

 private:
  struct Place {
    double time;
    Eigen::VectorXd value, velocity;
  };
  std::size_t places_;
  std::vector<Place> past_;  // the latest first
};

}  // namespace limber::rods::detail
