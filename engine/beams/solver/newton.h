#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "engine/base/job.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/beams/solver/balance.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/solver/load_path.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

enum class NewtonOutcome {
  kBalanced,    // and the stiffness is positive definite
  kTooFar,      // held nodes would move too far at once
  kMechanism,   // balanced, but something moves without resistance
  kNoProgress,  // no step lowers the potential or the residual, or numbers are not finite
  kLimit,       // of iterations
};

/// Treatment of a path along which the stiffness ceases to be positive definite.
enum class Forks {
  kIgnored,    // nothing
  kTaken,      // buckles to the side that loads push to, little as it may be: sure close to a fork
  kDescended,  // the same wherever it is not: off a branch that has ended, into the next valley
  kAvoided,    // gives up soon after: a shorter step tells more
};

/// Newton's method on the potential U - W by free unknowns, from state to state of a load path.
///
/// A stiffness that is not positive definite is shifted until it is. Balance there is a saddle,
/// which is left along the direction that buckles most. Steps follow second-order curves, so that
/// slender beams keep their lengths.
class NewtonSolver {
  enum class Definiteness { kPositive, kNot, kNotFinite };

 public:
  NewtonSolver(const BeamStructure& structure, const JobContext& context);

  /// Balances a state under the path at s.
  /// @param iterations  at most this many; the state is the best found in any case
  NewtonOutcome balance(BeamState& state, const LoadPath& path, double s, double tolerance,
                        int iterations, Forks forks = Forks::kIgnored);

  /// balance() ends with kLimit once so many factorizations are done, in all calls; 0: not limited.
  void limit_factorizations(int most) { most_factorizations_ = most; }

  /// End of the last balance().
  [[nodiscard]] const Imbalance& left() const { return left_; }
  [[nodiscard]] int iterations() const { return iterations_; }
  [[nodiscard]] int factorizations() const { return factorizations_; }
  /// Saddles that were balanced and left, in all calls; where the last one was softest.
  [[nodiscard]] int saddles() const { return saddles_; }
  [[nodiscard]] int saddle_unknown() const { return saddle_unknown_; }
  /// Did the stiffness cease to be positive definite during the last balance()?
  [[nodiscard]] bool has_forked() const { return has_forked_; }
  /// Was the stiffness positive definite where it was last looked at?
  [[nodiscard]] bool is_positive() const { return is_positive_; }

  enum class Stability {
    kStable,     // the stiffness is positive definite
    kNeutral,    // it is but for directions in which the state is one of a family of equilibria
    kMechanism,  // it is but for a direction in which nothing resists
    kSaddle,     // it is negative in a direction
    kNotFinite,
  };
  /// Verdict of the stiffness at a state; a direction that shows it, and its largest unknown: the
  /// softest one, or the one that buckles.
  struct Verdict {
    Stability stability = Stability::kNotFinite;
    int unknown = -1;
    Eigen::VectorXd direction;  // by all unknowns; empty where the stiffness is not finite
    Eigen::MatrixXd neutral;    // columns by all unknowns; see ZeroModes
  };
  /// By the inertia of the stiffness at this very state, with the potential of loads over elements.
  /// The imbalance there is forgiven: a neutral direction curves by as much.
  [[nodiscard]] Verdict judge(const BeamState& state, const NodeLoads& loads);
  /// For the state that balance() ended at: the directions of its verdict.
  [[nodiscard]] const Eigen::MatrixXd& neutral() const { return neutral_; }
  /// How far a step of Newton's method would still turn a balanced state [rad]; nothing where the
  /// stiffness is not positive definite.
  [[nodiscard]] std::optional<double> turn_left(const BeamState& state, const NodeLoads& loads);
  /// Above it, forces that balance within rounding are no equilibrium [rad].
  static constexpr double kResolvedTurn = 1e-3;
  /// Count for the stiffness at a state; those of rounding alone do not count.
  [[nodiscard]] int negative_eigenvalues(const BeamState& state, const NodeLoads& loads);

 private:
  Definiteness factor_positive(const BeamState& state, const NodeLoads& loads,
                               Forks forks = Forks::kIgnored);
  bool factor_at(double shift);
  bool factor_regularized();
  /// @param left  imbalance, by all unknowns; empty: none
  [[nodiscard]] Verdict judge_factored(const BeamState& state, const NodeLoads& loads,
                                       const Eigen::VectorXd& left);
  [[nodiscard]] Verdict judge_positive(const BeamState& state, const NodeLoads& loads,
                                       const Eigen::VectorXd& left);
  [[nodiscard]] double allowance(const Eigen::VectorXd& direction, const Eigen::VectorXd& noise,
                                 const Eigen::VectorXd& left) const;
  [[nodiscard]] Eigen::VectorXd solved(const Eigen::VectorXd& right) const;
  [[nodiscard]] Verdict verdict(Stability stability, const Eigen::VectorXd& direction) const;
  [[nodiscard]] Eigen::VectorXd noise() const;
  [[nodiscard]] Eigen::VectorXd residual(const BeamState& state, const NodeLoads& loads) const;
  [[nodiscard]] double potential_change(double energy, const Eigen::VectorXd& load,
                                        const BeamState& to, const NodeLoads& loads,
                                        const Eigen::VectorXd& increments) const;
  [[nodiscard]] Eigen::VectorXd curvature(const BeamState& state, const NodeLoads& loads,
                                          const Eigen::VectorXd& residual,
                                          const Eigen::VectorXd& step);
  /// A state on the curve of a step, and its known data.
  struct Trial {
    BeamState state;
    double change = 0;  // of the potential
    double scaled = 0;  // residual
  };
  /// By t times a step; nothing of the residual.
  [[nodiscard]] Trial go_along(const BeamState& state, const NodeLoads& loads, double energy,
                               const Eigen::VectorXd& load, const Eigen::VectorXd& step,
                               const Eigen::VectorXd& bend, double t) const;
  [[nodiscard]] Trial try_step(const BeamState& state, const NodeLoads& loads, double energy,
                               const Eigen::VectorXd& load, const Eigen::VectorXd& step,
                               const Eigen::VectorXd& bend, double t) const;
  bool search(BeamState& state, const NodeLoads& loads, const Eigen::VectorXd& residual,
              const Eigen::VectorXd& step, const Eigen::VectorXd& bend);
  bool advance(BeamState& state, const NodeLoads& loads, const Eigen::VectorXd& residual,
               const Eigen::VectorXd& step);
  /// With a factor of the stiffness at a state: the step to balance from there.
  [[nodiscard]] Eigen::VectorXd step_from(const Eigen::VectorXd& residual) const;
  /// The best of the states that balance but for rounding.
  struct Hidden {
    double turn = std::numeric_limits<double>::infinity();  // that was left there [rad]
    BeamState state;
  };
  /// For a state that balances with rounding forgiven and is a minimum, with its factor at hand:
  /// does rounding hide loads, so that another step gets nearer? If none did, the state becomes the
  /// best one.
  [[nodiscard]] bool is_hidden(const Eigen::VectorXd& residual, const NodeLoads& loads,
                               double tolerance, BeamState& state, Hidden& hidden) const;
  bool take_fork(BeamState& state, const NodeLoads& loads);
  bool leave_saddle(BeamState& state, const NodeLoads& loads, const Verdict& saddle);

  const BeamStructure& structure_;
  const JobContext& context_;
  Balance balance_;
  Stiffness stiffness_;
  SparseCholesky factor_;
  bool analysed_ = false;
  double shift_ = 0;  // that the last factor has
  Eigen::VectorXd weights_;
  Imbalance left_;
  // Steps that made things worse, from the last state that was better (`reference_`).
  struct Watch {
    int bad_steps = 0;
    double rise = 0;    // of the potential since
    double scaled = 0;  // residual there
    int careful = 0;    // iterations to go without such steps
    BeamState reference;
  } watch_;
  int iterations_ = 0;
  int factorizations_ = 0;
  int most_factorizations_ = 0;
  int saddles_ = 0;
  int saddle_unknown_ = -1;
  bool is_positive_ = true;
  bool has_forked_ = false;
  double regularization_ = 0;  // shift of factors where there are neutral directions; else 0
  Eigen::MatrixXd neutral_;
};

}  // namespace limber::beams::detail
