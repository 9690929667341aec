// Under moments that keep their direction and have no potential: Newton's method on forces alone,
// and the meaning of stability.

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/rods/equilibrium/moment_tangent.h"
#include "engine/rods/equilibrium/newton_run.h"

namespace limber::rods::detail {
namespace {

constexpr int kMaxMomentIterations = 40;
constexpr int kMomentPatience = 8;          // iterations without half of the least imbalance
constexpr double kLargestMomentTurn = 0.3;  // of one iteration [rad]
// Share of the bending at the size of the linkage: resists motions that the material does not.
constexpr double kLeastStiffness = 1e-3;

}  // namespace

/// Joints whose rotation is not held, by their first unknown of it.
std::vector<int> NewtonRun::free_moments() const {
  std::vector<int> result;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const int begin = model_.variables().joint_begin(j) + kJointRotation;
    if (!holding_.is_pinned(begin) && !terms_.moments().segment<3>(begin).isZero(0))
      result.push_back(begin);
  }
  return result;
}

/// Their dense parts are bounded.
bool NewtonRun::has_moment_tangent() const {
  return has_free_moments() && moments_.size() <= std::size_t{MomentTangent::kMaxJoints};
}

void NewtonRun::solve_with_moments(Eigen::VectorXd& right_side, const Eigen::VectorXd& rows) const {
  if (!has_moment_tangent()) return solve(right_side, rows);
  MomentTangent(*work_.factor, moments_, terms_.moments()).solve_in_place(right_side, rows);
}

/// Assembles the resistance of the rods whatever they carry.
void NewtonRun::assemble_material(const LinkageState& state) {
  if (!work_.material) work_.material.emplace(model_.chains());
  (void)work_.assembly.hessian(state, work_.scratch, *work_.material, Compression::kUnstressed);
}

/// Does every slow motion beside an equilibrium come back, as far as that is known? Masses are left
/// out: where they decide, a state flutters.
/// @pre the Hessian of the state is assembled, and indefinite
/// @returns false, without negative eigenvalues in the report, also where that is not known
bool NewtonRun::returns_slowly(const LinkageState& state) {
  const bool is_solved = has_moment_tangent() && factor_indefinite(state);
  report_.negative_eigenvalues = 0;
  if (!is_solved) return false;
  assemble_material(state);
  const double least =
      std::max(kLeastStiffness * work_.scales.softest_eigenvalue(), work_.scales.rounding_shift());
  const auto unstable =
      MomentTangent(*work_.factor, moments_, terms_.moments())
          .unstable({*work_.material, least * work_.scales.weights(), -work_.factor->shift});
  if (!unstable) return false;
  report_.negative_eigenvalues = *unstable;
  return *unstable == 0;
}

/// Starts where the Hessian, the symmetric part of the tangent, is no longer definite: descent
/// along it means nothing. @returns whether the state is balanced then; else it is unchanged
bool NewtonRun::balance_with_moments(LinkageState& state) {
  if (!has_moment_tangent()) return false;
  const LinkageState start = state;
  const Eigen::VectorXd increment = work_.total_increment;
  double best = std::numeric_limits<double>::infinity();
  int since = 0;
  for (int i = 0; i < kMaxMomentIterations && since <= kMomentPatience; ++i) {
    if (balanced()) return true;
    since = report_.max_gradient_scaled < 0.5 * best ? 0 : since + 1;
    best = std::min(best, report_.max_gradient_scaled);
    throw_if_interrupted();
    assemble(state, Compression::kBuckles);
    if (!factor_indefinite(state)) break;
    ++report_.iterations;
    Eigen::VectorXd x = -work_.gradient;
    if (!gap_.pinned.isZero(0)) {
      Eigen::VectorXd follow(x.size());
      work_.matrix.multiply(gap_.pinned, follow);
      x -= follow;
    }
    for (const int unknown : fixed()) x[unknown] = 0;
    for (const int unknown : holding_.pinned()) x[unknown] = gap_.pinned[unknown];
    solve_with_moments(x, gap_.rows);
    const double turn = work_.scales.largest_turn(model_, state, x);
    if (!std::isfinite(turn)) break;
    if (turn > kLargestMomentTurn) x *= kLargestMomentTurn / turn;
    if (bound_fraction(state, x) < 1) break;
    accept(state, state.moved(model_, x), x, x);
    if (!std::isfinite(potential_)) break;
  }
  if (balanced()) return true;
  accept(state, start, Eigen::VectorXd::Zero(increment.size()));
  work_.total_increment = increment;
  return false;
}

}  // namespace limber::rods::detail
