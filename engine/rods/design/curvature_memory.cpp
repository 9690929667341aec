#include "engine/rods/design/curvature_memory.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace limber::rods::detail {
namespace {

constexpr double kNegligibleCurvature =
    1e-12;  // curvature over the largest that the direction could have

}  // namespace

void CurvatureMemory::note(const Eigen::VectorXd& v, const Eigen::VectorXd& curved) {
  const double length = v.norm(), curvature = v.dot(curved);
  if (!(curvature > kNegligibleCurvature * length * curved.norm())) return;
  // Directions get unit length, so that sums do not depend on how long they were.
  pairs_.push_back({v / length, curved / length, curvature / (length * length)});
  if (pairs_.size() > kMaxPairs) pairs_.pop_front();
}

double CurvatureMemory::typical() const {
  const Pair& last = pairs_.back();
  return last.curved.squaredNorm() / last.curvature;
}

Eigen::VectorXd CurvatureMemory::inverse_times(Eigen::VectorXd v) const {
  if (pairs_.empty()) return v;
  std::vector<double> shares(pairs_.size());
  for (std::size_t k = pairs_.size(); k-- > 0;) {
    shares[k] = pairs_[k].v.dot(v) / pairs_[k].curvature;
    v -= shares[k] * pairs_[k].curved;
  }
  v /= typical();
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const double share = pairs_[k].curved.dot(v) / pairs_[k].curvature;
    v += (shares[k] - share) * pairs_[k].v;
  }
  return v;
}

double CurvatureMemory::size(const Eigen::VectorXd& v) const {
  if (pairs_.empty()) return v.norm();
  // M, update by update: M - (M s)(M s)^T / s^T M s + y y^T / s^T y.
  struct Update {
    Eigen::VectorXd moved;  // M s
    double curvature;       // s^T M s
  };
  std::vector<Update> updates;
  const double first = typical();
  const auto times = [&](const Eigen::VectorXd& x) {
    Eigen::VectorXd result = first * x;
    for (std::size_t k = 0; k < updates.size(); ++k) {
      result -= updates[k].moved.dot(x) / updates[k].curvature * updates[k].moved;
      result += pairs_[k].curved.dot(x) / pairs_[k].curvature * pairs_[k].curved;
    }
    return result;
  };
  for (const Pair& pair : pairs_) {
    Eigen::VectorXd moved = times(pair.v);
    const double curvature = pair.v.dot(moved);
    updates.push_back({std::move(moved), curvature});
  }
  return std::sqrt(std::max(0.0, v.dot(times(v))));
}

}  // namespace limber::rods::detail
