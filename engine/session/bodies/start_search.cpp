#include "engine/session/bodies/start_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

struct EndedStart {
  Eigen::MatrixXd motion;
  double energy = 0;
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

  /// @returns nothing where the start does not end in an optimum
  [[nodiscard]] std::optional<EndedStart> solve(const std::vector<std::size_t>& order) const {
    const spacetime::Material material =
        map_material(request_.problem.dynamics, request_.modes, *request_.model);
    spacetime::Solver solver(kinematics_, material.dynamics, request_.problem.timeline, options_,
                             material.mixing);
    solver.set_weight_scale(request_.problem.weight_scale);
    SolveReport report;
    if (order.empty()) {
      for (const PositionConstraint& constraint : constraints_) solver.add(constraint);
      report = solve_once(solver);
    }
    for (const std::size_t next : order) {
      solver.add(constraints_[next]);
      report = solve_once(solver);
    }
    if (report.status != SolveStatus::kConverged || !std::isfinite(report.total_energy))
      return std::nullopt;
    return EndedStart{solver.motion(), report.total_energy};
  }

 private:
  [[nodiscard]] SolveReport solve_once(spacetime::Solver& solver) const {
    SolveReport report = solver.solve({job_.cancellation, {}}, [&](const auto& /*improved*/) {
      return !job_.cancellation.requested();
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
  std::vector<EndedStart> ended = {{request.result->modal, request.result->report.total_energy}};
  for (const auto& order : orders_of(starts.constraints(), request.starts)) {
    if (auto one = starts.solve(order)) ended.push_back(std::move(*one));
  }
  StartFinding finding;
  StartComparison& comparison = finding.comparison;
  comparison.budget = request.starts + 1;
  comparison.compared = static_cast<int>(ended.size());
  const auto is_lower = [](const EndedStart& a, const EndedStart& b) {
    return a.energy < b.energy;
  };
  auto best = std::min_element(ended.begin(), ended.end(), is_lower);
  // What differs in the last digits alone is the shown motion.
  if (best->energy > (1 - kSameEnergy) * ended.front().energy) best = ended.begin();
  if (best != ended.begin()) finding.motion = best->motion;
  const Eigen::MatrixXd shown = shapes_of(request, best->motion, job);
  for (const EndedStart& one : ended) {
    comparison.largest_distance = std::max(
        comparison.largest_distance, largest_distance(shown, shapes_of(request, one.motion, job)));
  }
  std::sort(ended.begin(), ended.end(), is_lower);
  comparison.lowest_energy = ended.front().energy;
  comparison.highest_energy = ended.back().energy;
  comparison.optima = 1;
  for (std::size_t i = 1; i < ended.size(); ++i)
    if (ended[i].energy > (1 + kSameEnergy) * ended[i - 1].energy) ++comparison.optima;
  return finding;
}

std::string describe_starts(const StartComparison& comparison, double length_unit,
                            ShownStart shown) {
  if (comparison.optima < 2) return {};
  return fmt::format(
      "{} starts were compared and ended in {} different optima, of total energies {:.4g} to "
      "{:.4g} and up to {:.3g} apart: {}.",
      comparison.compared, comparison.optima, comparison.lowest_energy, comparison.highest_energy,
      comparison.largest_distance / length_unit,
      shown == ShownStart::kLowest
          ? "the lowest one is shown, and a still lower one is possible"
          : "a lower one than the shown one was found, but could not be taken over");
}

}  // namespace limber::session
