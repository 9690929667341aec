#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/base/job.h"
#include "engine/rods/design/design_rank.h"
#include "engine/session/linkages/design_values.h"
#include "engine/session/linkages/live_problem.h"

namespace limber::session {

/// A design of a live linkage. It starts from the present sizes of rods, the flat shape (free, or
/// held at a mean angle) and the present equilibrium. Works on copies: the live linkage does not
/// change. Driven by one thread.
class LiveDesign {
 public:
  struct Step {
    int iteration = 0;
    bool accepted = false;
    DesignTrials trials;
  };
  /// After every step, before the next. May set another goal.
  using OnStep = std::function<void(const Step& step)>;
  /// Called when the search would end, with its report. If it sets another goal, the search
  /// continues to that from the present point.
  using OnEnd = std::function<void(const rods::DesignReport& report)>;

  /// Finds the flat equilibrium.
  /// @pre the live linkage is in equilibrium without springs, loads and weight
  /// @throws Error: {kFailedPrecondition} with field flat where there is no flat equilibrium, with
  /// field flat_angle where it does not close (or open) to that; as
  /// rods::LinkageDesign; {kCancelled}
  /// @param energy_scale  E_0 [N length unit]; 0: the deployed energy of the start
  LiveDesign(const LiveLinkage& live, const DesignRequest& request, double energy_scale,
             const JobContext& job);

  /// @throws Error{kNumerical} where an equilibrium has no derivatives
  void run(const JobContext& job, const OnStep& on_step, const OnEnd& on_end);
  /// To the best there is, once the search is over. @returns whether that is not where the last
  /// step left it
  bool go_to_best();
  /// Takes effect at once: before the search, or within its callbacks.
  void set_goal(const DesignGoal& goal);

  /// By the present goal, as now and best.
  [[nodiscard]] const DesignTerms& start() const { return start_; }
  [[nodiscard]] const DesignTerms& now() const { return now_; }
  [[nodiscard]] const DesignTerms& best() const { return best_; }
  [[nodiscard]] int best_iteration() const { return best_iteration_; }
  [[nodiscard]] double flat_height_allowed() const { return options_.flat_height; }
  [[nodiscard]] const std::optional<double>& smallest_angle_allowed() const {
    return smallest_angle_;
  }
  /// That the flat shape is held at [rad].
  [[nodiscard]] const std::optional<double>& flat_angle() const {
    return design_->flat().mean_opening_angle;
  }
  [[nodiscard]] std::shared_ptr<const DesignCandidate> candidate() const { return candidate_; }
  /// Coordinates (LinkageShape) of the flat shape and of the deployed one, a column each.
  [[nodiscard]] Eigen::MatrixXd shapes() const;
  [[nodiscard]] double mean_angle() const;  // of the deployed shape [rad]
  /// The remarks on its present state: see design_release.h.
  [[nodiscard]] std::string release(const JobContext& job) const;
  struct FoundErection {
    std::shared_ptr<const scene::LinkageErection> erection;  // null: none
    std::string message;                                     // why there is none
  };
  /// Finds how to open the present shape. @throws Error{kCancelled}
  [[nodiscard]] FoundErection find_erection(const JobContext& job) const;
  /// The requested angle, see DesignRequest.
  [[nodiscard]] const std::optional<double>& requested_flat_angle() const {
    return requested_flat_angle_;
  }
  /// Scales of those shapes; empty: all 1.
  [[nodiscard]] const Eigen::VectorXd& section_scales() const { return design_->point().sections; }
  /// Terms of an earlier design's result, by the present goal.
  [[nodiscard]] DesignTerms terms_of(const DesignCandidate& candidate);
  /// From the best that there is.
  [[nodiscard]] rods::DesignDifference difference_from(const DesignCandidate& candidate) const;
  [[nodiscard]] double energy_scale() const { return design_->criteria().energy_scale; }
  [[nodiscard]] double extent() const { return design_->criteria().length_scale; }
  /// Number of varied lengths; they are the first variables.
  [[nodiscard]] int varied_lengths() const { return design_->variables().lengths(); }

 private:
  [[nodiscard]] RodSizes sizes() const;  // as a document would have them
  [[nodiscard]] rods::DesignCriteria criteria() const;
  [[nodiscard]] DesignTerms measure(const rods::DesignPoint& point);
  [[nodiscard]] rods::DesignRank rank(const DesignTerms& terms) const;
  [[nodiscard]] bool has_moved() const { return design_->parameters() != measured_; }
  void measure_here();
  void see_here();  // measures, and keeps the best
  void begin_best();

  const LinkageShape shape_;
  const double length_unit_;
  DesignGoal goal_;
  rods::DesignOptimizerOptions options_;
  std::optional<double> smallest_angle_;
  const std::optional<double> requested_flat_angle_;
  const double least_cover_;
  double start_area_ = 0;  // of the deployed linkage's cells [length unit^2]
  std::optional<rods::LinkageDesign> design_;
  std::optional<rods::DesignPoint> start_point_;
  DesignTerms start_, now_, best_;
  Eigen::VectorXd measured_, best_parameters_;  // what now_ and best_ are of
  int iteration_ = 0, best_iteration_ = 0;
  std::shared_ptr<const DesignCandidate> candidate_;
};

}  // namespace limber::session
