#include "engine/base/numerics/nnls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/numerics/growing_cholesky.h"

namespace limber {
namespace {

void check_gram(const Eigen::Ref<const Eigen::MatrixXd>& gram,
                const Eigen::Ref<const Eigen::VectorXd>& rhs) {
  if (gram.rows() != gram.cols() || gram.rows() != rhs.size()) {
    throw Error(ErrorCode::kInvalidArgument, "gram",
                fmt::format("gram is {} x {} and rhs has {} entries: they must agree", gram.rows(),
                            gram.cols(), rhs.size()));
  }
  if (!gram.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "gram", "gram has entries that are not finite");
  }
  if (!rhs.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "rhs", "rhs has entries that are not finite");
  }
  if (gram.size() > 0 && gram.diagonal().minCoeff() < 0) {
    throw Error(ErrorCode::kInvalidArgument, "gram", "gram has a negative diagonal entry");
  }
}

class ActiveSet {
 public:
  ActiveSet(const Eigen::Ref<const Eigen::MatrixXd>& gram,
            const Eigen::Ref<const Eigen::VectorXd>& rhs, const NnlsOptions& options)
      : options_(options),
        unscale_(
            gram.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; })),
        gram_(unscale_.asDiagonal() * gram * unscale_.asDiagonal()),
        rhs_(unscale_.cwiseProduct(rhs)),
        cholesky_(gram.rows()),
        x_(Eigen::VectorXd::Zero(rhs.size())),
        position_(static_cast<std::size_t>(rhs.size()), -1) {
    const double largest = rhs_.size() > 0 ? rhs_.cwiseAbs().maxCoeff() : 0.0;
    if (largest > 0) {
      rhs_ /= largest;
      rhs_unit_ = largest;
    }
  }

  NnlsResult run(const std::vector<int>& warm_support) {
    for (const int column : warm_support) {
      if (position_[column] < 0) enter(column);
    }
    if (!active_.empty()) descend();
    const auto columns = static_cast<int>(rhs_.size());
    const int limit = options_.max_iterations > 0 ? options_.max_iterations : 10 * columns + 100;
    std::vector<char> blocked(static_cast<std::size_t>(columns), 0);
    NnlsResult result;
    while (true) {
      const Eigen::VectorXd gradient = rhs_ - gram_ * x_;
      const int column = steepest(gradient, blocked);
      if (column < 0) {
        result.converged = true;
        break;
      }
      if (iterations_ >= limit) break;
      // A dependent column, or one that rounding sends straight back, must wait for another active
      // set.
      const double before = energy();
      if (enter(column)) descend();
      const bool gained = position_[column] >= 0 && energy() < before;
      if (gained) {
        std::fill(blocked.begin(), blocked.end(), 0);
      } else {
        blocked[column] = 1;
      }
    }
    result.iterations = iterations_;
    result.x = rhs_unit_ * unscale_.cwiseProduct(x_);
    result.support = active_;
    std::sort(result.support.begin(), result.support.end());
    const Eigen::VectorXd gradient = rhs_ - gram_ * x_;
    for (Eigen::Index j = 0; j < gradient.size(); ++j) {
      const double violation = position_[j] >= 0 ? std::abs(gradient[j]) : gradient[j];
      result.optimality = std::max(result.optimality, violation);
    }
    return result;
  }

 private:
  double energy() const { return 0.5 * x_.dot(gram_ * x_) - rhs_.dot(x_); }

  int steepest(const Eigen::VectorXd& gradient, const std::vector<char>& blocked) const {
    int best = -1;
    for (int j = 0; j < gradient.size(); ++j) {
      if (position_[j] >= 0 || blocked[j] || unscale_[j] == 0) continue;
      if (gradient[j] > options_.tolerance && (best < 0 || gradient[j] > gradient[best])) best = j;
    }
    return best;
  }

  bool enter(int column) {
    const Eigen::VectorXd cross = gram_.col(column)(active_);
    if (!cholesky_.append(cross, gram_(column, column), options_.rank_tolerance)) return false;
    position_[column] = static_cast<int>(active_.size());
    active_.push_back(column);
    return true;
  }

  void leave(int index) {
    x_[active_[index]] = 0;
    position_[active_[index]] = -1;
    cholesky_.remove(index);
    active_.erase(active_.begin() + index);
    for (int k = index; k < static_cast<int>(active_.size()); ++k) position_[active_[k]] = k;
  }

  /// Goes to the minimum over the active columns, dropping those that would turn negative
  /// before it.
  void descend() {
    while (!active_.empty()) {
      ++iterations_;
      const Eigen::VectorXd target = cholesky_.solve(rhs_(active_));
      double step = 1;
      int first_blocking = -1;
      for (int k = 0; k < static_cast<int>(active_.size()); ++k) {
        if (target[k] > 0) continue;
        const double from = x_[active_[k]];
        const double reach = from > 0 ? from / (from - target[k]) : 0.0;
        if (first_blocking >= 0 && reach >= step) continue;
        step = reach;
        first_blocking = k;
      }
      if (first_blocking < 0) {
        x_(active_) = target;
        return;
      }
      for (int k = 0; k < static_cast<int>(active_.size()); ++k) {
        double& value = x_[active_[k]];
        value = std::max(0.0, value + step * (target[k] - value));
      }
      for (int k = static_cast<int>(active_.size()) - 1; k >= 0; --k) {
        if (k == first_blocking || (target[k] <= 0 && x_[active_[k]] == 0)) leave(k);
      }
    }
  }

  const NnlsOptions& options_;
  Eigen::VectorXd unscale_;
  Eigen::MatrixXd gram_;
  Eigen::VectorXd rhs_;
  double rhs_unit_ = 1;
  GrowingCholesky cholesky_;
  Eigen::VectorXd x_;
  std::vector<int> position_;  // per column its place in active_, -1 if inactive
  std::vector<int> active_;
  int iterations_ = 0;
};

void demand_share(double value, const char* member) {
  if (value > 0 && value < 1) return;
  throw Error(ErrorCode::kInvalidArgument, member,
              fmt::format("{} must be in (0, 1), not {}", member, value));
}

}  // namespace

void NnlsOptions::validate() const {
  demand_share(tolerance, "tolerance");
  demand_share(rank_tolerance, "rank_tolerance");
  if (max_iterations < 0) {
    throw Error(ErrorCode::kInvalidArgument, "max_iterations",
                fmt::format("max_iterations must be >= 0, not {}", max_iterations));
  }
}

NnlsResult nnls(const Eigen::Ref<const Eigen::MatrixXd>& gram,
                const Eigen::Ref<const Eigen::VectorXd>& rhs, const NnlsOptions& options,
                const std::vector<int>& warm_support) {
  options.validate();
  check_gram(gram, rhs);
  for (const int column : warm_support) {
    if (column < 0 || column >= rhs.size()) {
      throw Error(ErrorCode::kOutOfRange, "warm_support",
                  fmt::format("column {} is not in [0, {})", column, rhs.size()));
    }
  }
  return ActiveSet(gram, rhs, options).run(warm_support);
}

}  // namespace limber
