#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/hessian_factor.h"
#include "engine/rods/equilibrium/holding.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/linkage_assembly.h"

namespace limber::rods::detail {

/// Gaps below this are closed along the path; larger ones are paths of their own.
inline constexpr double kSmallGap = 1e-6;
/// Parts of a step below this are no step.
inline constexpr double kShortestFraction = 1e-7;
/// Share of the material stiffness that is subtracted from nearly singular Hessians.
inline constexpr double kMaterialShare = 1e-2;

/// Data that stays from solve to solve.
struct NewtonWorkspace {
  explicit NewtonWorkspace(const LinkageModel& linkage);

  /// Measures anew where the model's sections have been scaled since.
  NewtonWorkspace& for_present_sections();
  /// Discards data of the place where the last search ended, which misleads elsewhere.
  void begin_at(const LinkageState& state);

  const LinkageModel& model;
  UnknownScales scales;
  Eigen::VectorXd sections;  // whose measures these are
  LinkageAssembly assembly;
  CondensedMatrix matrix;
  std::optional<CondensedMatrix> material;  // Compression::kUnstressed, where moments ask for it
  std::unique_ptr<HessianFactor> factor;    // of the last factorisation
  /// The last one without a shift before it, of solves that are watched; null: none. A factor that
  /// holds a step while it is bent is no factor to begin with if the solve was interrupted then.
  std::unique_ptr<HessianFactor> unshifted;
  Eigen::VectorXd gradient;
  Eigen::VectorXd scratch;  // the gradient that comes with a Hessian
  Eigen::VectorXd total_increment;
  EdgeTensions tensions;
  bool expected = false;   // are the tensions those to be expected at the state
  double guess_shift = 0;  // the same of guesses
  double shift = 0;        // of the last indefinite Hessian
  bool certified = false;  // is the factor of an equilibrium, where the last solve ended
  bool mechanism = false;  // was the last one indefinite by rounding only
  std::vector<JointState<double>> end;  // where the last search ended
};

/// One search for an equilibrium.
class NewtonRun {
 public:
  NewtonRun(NewtonWorkspace& workspace, const Conditions& conditions,
            const EquilibriumOptions& options, const LinkageState& start);

  EquilibriumReport run(LinkageState& state, const JobContext& context,
                        const IterateCallback& on_iterate);

  /// See LinkageEquilibrium::judge.
  [[nodiscard]] EquilibriumReport judge(const LinkageState& state);

  /// The gradient of elastic energy, springs and loads on all unknowns, also those that are held.
  [[nodiscard]] const Eigen::VectorXd& gradient_at(const LinkageState& state);
  [[nodiscard]] const GradientSize& forces_present() const { return scale_; }
  [[nodiscard]] Eigen::VectorXd softest_at(const LinkageState& state);
  /// See LinkageEquilibrium::motion.
  [[nodiscard]] LinkageEquilibrium::Motion motion_to(NewtonRun& ahead, const LinkageState& state);

 private:
  struct Step {
    Eigen::VectorXd x;
    bool prescribed;       // moves towards the targets of pins and constraints
    double slope;          // of the potential along it
    double turn;           // largest angle of a joint or an edge [rad]
    double undamped_turn;  // the same, before it was limited
  };

  void evaluate(const LinkageState& state);
  double free_gradient(Eigen::VectorXd& free) const;
  /// Weak holds keep steps from drifting; of stability they say nothing.
  enum class WeakHolds { kAdded, kLeftOut };
  void assemble(const LinkageState& state, Compression compression,
                WeakHolds holds = WeakHolds::kAdded);
  [[nodiscard]] std::vector<int> fixed() const;
  [[nodiscard]] double potential(const LinkageState& state) const;
  [[nodiscard]] double rounding() const;
  [[nodiscard]] bool balanced() const;

  bool factor(double shift);
  bool factor_indefinite(const LinkageState& state);
  void assemble_material(const LinkageState& state);
  [[nodiscard]] bool solves(double max_error) const;
  void factor_shifted(double first, double& kept);
  void factor_positive(double least, const LinkageState& state);
  [[nodiscard]] Step newton_step(const LinkageState& state);
  [[nodiscard]] Step step_with_factor(const LinkageState& state) const;
  /// A shape beside the state.
  struct Shown {
    LinkageState state;
    Eigen::VectorXd increment;
  };
  void search(LinkageState& state, const IterateCallback& on_iterate);
  bool chords(LinkageState& state, const IterateCallback& on_iterate);
  void show_correction(const LinkageState& state, const Step& step,
                       const IterateCallback& on_iterate);
  [[nodiscard]] bool correct(Shown& trial);
  void keep_unshifted_factor();
  void interrupt(LinkageState& state);
  void throw_if_interrupted() const;
  void show(const LinkageState& state, const IterateCallback& on_iterate);
  void solve(Eigen::VectorXd& right_side, const Eigen::VectorXd& rows) const;
  [[nodiscard]] std::vector<int> free_moments() const;
  [[nodiscard]] bool has_free_moments() const { return !moments_.empty(); }
  void solve_with_moments(Eigen::VectorXd& right_side, const Eigen::VectorXd& rows) const;
  [[nodiscard]] bool has_moment_tangent() const;
  bool returns_slowly(const LinkageState& state);
  bool balance_with_moments(LinkageState& state);

  void limit(const LinkageState& state, double largest, Step& step) const;
  static void shrink(double largest, Step& step);
  void move_prescribed(LinkageState& state, Eigen::VectorXd x);
  bool block(const LinkageState& state, const Eigen::VectorXd& x);
  [[nodiscard]] double bound_fraction(const LinkageState& state, const Eigen::VectorXd& x) const;
  bool take(LinkageState& state, Step step);
  bool descend(LinkageState& state, const Step& step, double fraction);
  void shorten(const LinkageState& state, Step& step);
  void update_trust_radius(const Step& step, double fraction, double gain);
  bool calmer(const LinkageState& trial);
  bool recentred(LinkageState& trial, double below, Eigen::VectorXd& x);
  void hold_soft(const Step& step);
  [[nodiscard]] double curvature(const Step& step) const;
  bool farther(const LinkageState& state, const Step& step, const Eigen::VectorXd& bend,
               LinkageState& there, Eigen::VectorXd& increment);
  [[nodiscard]] Eigen::VectorXd acceleration(const LinkageState& state, const Eigen::VectorXd& v);
  [[nodiscard]] Eigen::VectorXd beside(Eigen::VectorXd x, const Eigen::VectorXd& direction) const;
  [[nodiscard]] bool towards_saddle(const Step& step) const;
  bool hides_loads(const LinkageState& state);
  bool certify(const LinkageState& state);
  [[nodiscard]] bool has_descent_direction(const LinkageState& state);
  bool escape(LinkageState& state);
  struct Escape {
    LinkageState there;
    Eigen::VectorXd increment, along;  // with and without its bend
    double gain = 0;                   // of the potential, with the work of moments
  };
  [[nodiscard]] std::optional<Escape> follow(const LinkageState& state,
                                             const Eigen::VectorXd& direction,
                                             const Eigen::VectorXd& bend) const;
  [[nodiscard]] Eigen::VectorXd softened(const Eigen::VectorXd& v) const;
  [[nodiscard]] Eigen::VectorXd softest_direction(const LinkageState& state);
  void accept(LinkageState& state, LinkageState next, const Eigen::VectorXd& x,
              const Eigen::VectorXd& linear = {});
  void set_active_bounds(const LinkageState& state);
  void finish(EquilibriumStatus status, std::string message);
  [[nodiscard]] std::string imbalance_text() const;
  [[nodiscard]] std::string converged_text() const;
  [[nodiscard]] std::string saddle_text() const;

  NewtonWorkspace& work_;
  const LinkageModel& model_;
  const EquilibriumOptions& options_;
  ConditionTerms terms_;
  Holding holding_;
  std::vector<int> moments_;  // see free_moments()
  double shortest_;           // share of rest that a joint's edges keep

  Cancellation cancellation_;
  bool is_watched_ = false, has_shown_ = false;
  /// The last correction that was shown, while the state is where the search began.
  std::optional<Shown> shown_;
  std::vector<int> bounded_;  // lengths that rest on their bound
  Holding::Gap gap_;
  int hidden_load_checks_ = 0;  // how often the allowance for rounding might have hidden loads
  double beyond_ = 0;           // the drawing: how far away the state lies [length]
  double potential_ = 0;
  double potential_size_ = 0;
  GradientSize scale_;
  bool stable_ = false;         // does a factor of this very state say that it is a minimum
  bool indefinite_ = false;     // was the last Hessian, with the least shift
  bool tried_moments_ = false;  // see balance_with_moments()
  double damping_ = 0;          // least shift
  double step_shift_ = 0;       // with which the last step was made
  double radius_;               // turn up to which steps are believed [rad]
  Eigen::VectorXd along_;       // the last step, where little resists; empty: nothing special
  EquilibriumReport report_;
};

}  // namespace limber::rods::detail
