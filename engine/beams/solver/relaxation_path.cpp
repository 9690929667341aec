#include "engine/beams/solver/relaxation_path.h"

#include <fmt/core.h>

#include <limits>
#include <optional>
#include <utility>

#include "engine/beams/solver/balance.h"
#include "engine/beams/solver/finite_state.h"
#include "engine/beams/solver/relaxation.h"
#include "engine/beams/solver/twist_watch.h"

namespace limber::beams::detail {

namespace {

constexpr int kRelaxationStepsBetweenChecks = 25;  // of the residual and of cancellation
constexpr int kStepsBetweenFrames = 200;           // for the observer
/// Without a residual a tenth below the best in as many steps, rounding is all that is left.
constexpr int kRelaxationPatience = 200000;
constexpr double kMaxPressure = 0.05;       // of elements during the ramp, see Relaxation::pressure
constexpr double kMaxBend = 0.5;            // the same, see Relaxation::bend
constexpr double kSlowest = 0.05;           // of the ramp's pace
constexpr double kFarAway = 1e3;            // extents
constexpr double kMaxTurnOfRampStep = 0.1;  // of held nodes, in one step of the ramp [rad]
constexpr int kStepsBetweenTwists = 5;      // each turns nodes by at most 0.2 rad

/// One run of the relaxation, with its reports to the caller.
class Run {
 public:
  Run(const BeamStructure& structure, const LoadPath& path, const BeamSolveOptions& options,
      const JobContext& context, const BeamObserver& observer, BeamState& state, BeamReport& report)
      : model_(structure.model()),
        path_(path),
        options_(options),
        context_(context),
        observer_(observer),
        state_(state),
        report_(report),
        balance_(structure),
        relaxation_(structure, state) {
    if (path.turn() > 0) twist_.emplace(structure, state);
  }

  /// @returns whether to continue
  bool bring_on() {
    const int ramp = path_.varies() ? options_.ramp_steps : 0;
    if (path_.nudged()) {
      loads_ = path_.loads(0);
      relaxation_.set_loads(loads_);
      for (int i = 0; i < ramp; ++i) step(0);
    }
    // Motions wait while elements are pressed: pushed on, they would fold up.
    double at = 0;
    while (ramp > 0 && at < 1) {
      const double strain =
          std::max(relaxation_.pressure() / kMaxPressure, relaxation_.bend() / kMaxBend);
      const double calm = std::max(0.0, 1 - strain);
      const double pace = std::max(calm, kSlowest) / ramp;
      at = std::min(1.0, at + std::min(pace, kMaxTurnOfRampStep /
                                                 std::max(kMaxTurnOfRampStep, path_.turn())));
      loads_ = path_.loads(at);
      relaxation_.set_loads(loads_);
      relaxation_.drive(path_, at);
      step(at);
      if (slips()) return false;
      if (at < 1 && report_.relaxation_steps >= options_.relaxation_steps) {
        if (look()) finish_at_limit();
        return false;
      }
    }
    loads_ = path_.loads(1);
    relaxation_.set_loads(loads_);
    relaxation_.drive(path_, 1);
    return true;
  }

  void settle(double tolerance) {
    double best = std::numeric_limits<double>::infinity();
    int best_step = report_.relaxation_steps;
    for (;;) {
      step(1);
      if (slips()) return;
      if (report_.relaxation_steps % kRelaxationStepsBetweenChecks != 0) continue;
      if (!look()) return finish(BeamStatus::kUnstable, divergence_text());
      if (report_.residual <= tolerance)
        return finish(BeamStatus::kConverged, "forces and moments balance");
      if (report_.residual < 0.9 * best) {
        best = report_.residual;
        best_step = report_.relaxation_steps;
      }
      if (report_.relaxation_steps - best_step > kRelaxationPatience)
        return finish(BeamStatus::kStalled,
                      fmt::format("the dynamic relaxation stagnates at residual {:.2g}", best));
      if (report_.relaxation_steps >= options_.relaxation_steps) return finish_at_limit();
    }
  }

  /// The last state that is one.
  void keep_state() {
    BeamState reached = relaxation_.state();
    if (is_finite(reached)) state_ = std::move(reached);
  }

 private:
  void step(double s) {
    relaxation_.step();
    ++report_.relaxation_steps;
    report_.load_factor = s;
    if (report_.relaxation_steps % kStepsBetweenFrames != 0) return;
    if (context_.cancellation.requested()) {
      keep_state();
      context_.throw_if_cancelled();
    }
    context_.report("relaxation", 0.5 * s);
    if (!observer_) return;
    keep_state();
    observer_({&state_, s, report_.residual, report_.relaxation_steps});
  }

  /// Ends where a turn that was prescribed slips through an element: attitudes would not show it.
  bool slips() {
    if (!twist_ || report_.relaxation_steps % kStepsBetweenTwists != 0) return false;
    twist_->look(relaxation_.state());
    const std::optional<int> element = twist_->slipped();
    if (!element) return false;
    report_.is_unresolved = true;
    finish(BeamStatus::kUnstable, fmt::format("a turn slipped through {}: take shorter elements",
                                              element_name(model_, *element)));
    return true;
  }

  void finish_at_limit() {
    finish(BeamStatus::kIterationLimit,
           fmt::format("residual {:.2g} after all steps", report_.residual));
  }

  [[nodiscard]] static std::string divergence_text() {
    return fmt::format(
        "the dynamic relaxation diverged: nodes moved more than {:g} times the structure's extent",
        kFarAway);
  }

  /// Residual of the last step; false where the numbers have grown beyond meaning.
  bool look() {
    if (!relaxation_.finite()) return false;
    const Relaxation::Residual left = relaxation_.residual();
    const PresentForces present =
        balance_.present(PresentForces{left.present_force, left.present_moment}, loads_);
    const Imbalance worst = balance_.imbalance(left.unbalanced, present);
    report_.residual = worst.scaled;
    report_.node = balance_.node_of(worst.unknown);
    return relaxation_.farthest() < kFarAway * balance_.extent() + balance_.farthest();
  }

  void finish(BeamStatus status, const std::string& message) {
    report_.status = status;
    report_.message = message;
    keep_state();
  }

  const BeamModel& model_;
  const LoadPath& path_;
  const BeamSolveOptions& options_;
  const JobContext& context_;
  const BeamObserver& observer_;
  BeamState& state_;
  BeamReport& report_;
  Balance balance_;
  Relaxation relaxation_;
  std::optional<TwistWatch> twist_;  // where nodes are turned
  NodeLoads loads_;
};

}  // namespace

void relax(const BeamStructure& structure, const LoadPath& path, double tolerance,
           const BeamSolveOptions& options, const JobContext& context, const BeamObserver& observer,
           BeamState& state, BeamReport& report) {
  Run run(structure, path, options, context, observer, state, report);
  if (run.bring_on()) run.settle(tolerance);
}

}  // namespace limber::beams::detail
