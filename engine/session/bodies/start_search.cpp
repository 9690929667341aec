#include "engine/session/bodies/start_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/session/bodies/session.h"

namespace limber::session {
namespace {

using spacetime::PositionConstraint;
using spacetime::SolveReport;
using spacetime::SolveStatus;

/// Energies that differ by less than this share are of one optimum.
constexpr double kSameEnergy = 1e-3;
/// Frames in which motions are compared.
constexpr Eigen::Index kComparedFrames = 16;
constexpr std::uint64_t kSeed = 20260;

/// Iterations of a solve that is followed by others: the next constraint does not wait for the end.
constexpr int kIterationsOnTheWay = 40;

struct EndedStart {
  Eigen::MatrixXd motion;
  SolveReport report;
};

/// Orders in which constraints are added. Empty: all at once, from rest.
std::vector<std::vector<std::size_t>> orders_of(const std::vector<PositionConstraint>& constraints,
                                                int count) {
  std::vector<std::size_t> order(constraints.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<std::vector<std::size_t>> orders = {{}};
  const auto add_sorted = [&](const auto& precedes) {
    auto sorted = order;
    std::stable_sort(sorted.begin(), sorted.end(), [&](std::size_t a, std::size_t b) {
      return precedes(constraints[a], constraints[b]);
    });
    orders.push_back(sorted);
    std::reverse(sorted.begin(), sorted.end());
    orders.push_back(std::move(sorted));
  };
  add_sorted([](const auto& a, const auto& b) { return a.frame < b.frame; });
  add_sorted([](const auto& a, const auto& b) { return a.target.norm() > b.target.norm(); });
  Random random(kSeed);
  while (static_cast<int>(orders.size()) < count) {
    auto shuffled = order;
    for (std::size_t i = shuffled.size(); i > 1; --i)
      std::swap(shuffled[i - 1], shuffled[static_cast<std::size_t>(random.index(i))]);
    orders.push_back(std::move(shuffled));
  }
  orders.resize(static_cast<std::size_t>(count));
  return orders;
}

class StartSolver {
 public:
  StartSolver(const StartRequest& request, const spacetime::SolverOptions& options,
              const JobContext& job)
      : request_(request), options_(options), job_(job) {
    kinematics_ = std::make_shared<reduced::FullKinematics>(
        request.body->mapped.body, request.model, request.body->reconstruction, request.body->base);
    for (const auto& [constraint, site] : request.problem.constraints) {
      constraints_.push_back(constraint);
      constraints_.back().site = kinematics_->add_site(*site);
    }
  }

  [[nodiscard]] const std::vector<PositionConstraint>& constraints() const { return constraints_; }

  /// @returns nothing where the start ends without a motion
  [[nodiscard]] std::optional<EndedStart> solve(const std::vector<std::size_t>& order) const {
    spacetime::Solver solver = make_solver();
    SolveReport report;
    if (order.empty()) {
      for (const PositionConstraint& constraint : constraints_) solver.add(constraint);
      report = iterate(solver, std::numeric_limits<int>::max());
    }
    for (const std::size_t next : order) {
      solver.add(constraints_[next]);
      const bool is_last = next == order.back();
      report = iterate(solver, is_last ? std::numeric_limits<int>::max() : kIterationsOnTheWay);
    }
    if (!std::isfinite(report.total_energy)) return std::nullopt;
    return EndedStart{solver.motion(), report};
  }

  /// The start with the best end; the first, the shown motion, unless another is clearly better.
  [[nodiscard]] std::size_t best_of(const std::vector<EndedStart>& ended) const {
    const spacetime::Solver solver = make_solver();
    std::size_t best = 0;
    for (std::size_t i = 1; i < ended.size(); ++i)
      if (solver.prefers(ended[i].report, ended[best].report)) best = i;
    return best;
  }

 private:
  [[nodiscard]] spacetime::Solver make_solver() const {
    const spacetime::Material material =
        map_material(request_.problem.dynamics, request_.modes, *request_.model);
    spacetime::Solver solver(kinematics_, material.dynamics, request_.problem.timeline, options_,
                             material.mixing);
    solver.set_load(request_.problem.load);
    solver.set_weight_scale(request_.problem.weight_scale);
    return solver;
  }

  [[nodiscard]] SolveReport iterate(spacetime::Solver& solver, int most) const {
    int taken = 0;
    SolveReport report = solver.solve({job_.cancellation, {}}, [&](const auto& /*improved*/) {
      return ++taken < most && !job_.cancellation.requested();
    });
    job_.throw_if_cancelled();
    return report;
  }

  const StartRequest& request_;
  const spacetime::SolverOptions& options_;
  const JobContext& job_;
  std::shared_ptr<reduced::FullKinematics> kinematics_;
  std::vector<PositionConstraint> constraints_;
};

/// Some frames of a motion by full reconstruction, without a base motion [m].
Eigen::MatrixXd shapes_of(const StartRequest& request, const Eigen::MatrixXd& motion,
                          const JobContext& job) {
  const Eigen::Index count = std::min(kComparedFrames, motion.cols());
  Eigen::MatrixXd some(motion.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i)
    some.col(i) = motion.col(count > 1 ? i * (motion.cols() - 1) / (count - 1) : 0);
  return request.body->reconstruction->from_linear(
      request.model->modes.leftCols(motion.rows()) * some, job);
}

double largest_distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::MatrixXd apart = a - b;
  return std::sqrt(apart.reshaped(3, apart.size() / 3).colwise().squaredNorm().maxCoeff());
}

template <class T>
void require_at_least(T value, T least, const char* member) {
  if (value >= least) return;
  throw Error(ErrorCode::kInvalidArgument, member,
              fmt::format("{} = {}, must be >= {}", member, value, least));
}

}  // namespace

void StartSearchOptions::validate() const {
  require_at_least(starts, 1, "starts");
  require_at_least(least_reach, 0.0, "least_reach");
  require_at_least(most_tets, 0, "most_tets");
  require_at_least(most_frames, 0, "most_frames");
  require_at_least(most_constraints, 0, "most_constraints");
  require_at_least(most_work, std::int64_t{0}, "most_work");
}

int StartSearchOptions::starts_within(int constraints, int frames, int tets) const {
  const std::int64_t solves = most_work / (std::int64_t{frames} * tets);
  const std::int64_t in_order = (solves - 1) / constraints;
  return in_order < 1 ? 0 : static_cast<int>(std::min<std::int64_t>(starts, in_order + 1));
}

StartFinding search_starts(const StartRequest& request, const spacetime::SolverOptions& solver,
                           const JobContext& job) {
  const StartSolver starts(request, solver, job);
  std::vector<EndedStart> ended = {{request.result->modal, request.result->report}};
  for (const auto& order : orders_of(starts.constraints(), request.starts)) {
    if (auto one = starts.solve(order)) ended.push_back(std::move(*one));
  }
  const std::size_t best = starts.best_of(ended);
  StartFinding finding;
  if (best > 0) finding.motion = ended[best].motion;
  StartComparison& comparison = finding.comparison;
  comparison.budget = request.starts + 1;
  comparison.compared = static_cast<int>(ended.size());
  const Eigen::MatrixXd shown = shapes_of(request, ended[best].motion, job);
  std::vector<double> energies, optima;
  for (const EndedStart& one : ended) {
    comparison.largest_distance = std::max(
        comparison.largest_distance, largest_distance(shown, shapes_of(request, one.motion, job)));
    energies.push_back(one.report.total_energy);
    if (one.report.status == SolveStatus::kConverged) optima.push_back(one.report.total_energy);
  }
  const auto [lowest, highest] = std::minmax_element(energies.begin(), energies.end());
  comparison.lowest_energy = *lowest;
  comparison.highest_energy = *highest;
  comparison.unconverged = static_cast<int>(ended.size() - optima.size());
  std::sort(optima.begin(), optima.end());
  for (std::size_t i = 0; i < optima.size(); ++i)
    if (i == 0 || optima[i] > (1 + kSameEnergy) * optima[i - 1]) ++comparison.optima;
  return finding;
}

std::string describe_starts(const StartComparison& comparison, double length_unit,
                            ShownStart shown) {
  if (comparison.optima < 2 && comparison.unconverged == 0) return {};
  const std::string ended =
      comparison.unconverged == 0
          ? fmt::format("and ended in {} different optima", comparison.optima)
          : fmt::format("and {} of them did not converge", comparison.unconverged);
  return fmt::format(
      "{} starts were compared {}, of total energies {:.4g} to {:.4g} and up to {:.3g} apart: {}.",
      comparison.compared, ended, comparison.lowest_energy, comparison.highest_energy,
      comparison.largest_distance / length_unit,
      shown == ShownStart::kLowest
          ? "the lowest one is shown, and a still lower one is possible"
          : "a lower one than the shown one was found, but could not be taken over");
}

}  // namespace limber::session
