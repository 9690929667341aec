#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "engine/rods/design/best_design.h"
#include "engine/rods/design/curvature_memory.h"
#include "engine/rods/design/design_merit.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/trust_region_step.h"

namespace limber::rods::detail {

/// Least and largest parameters.
struct DesignBounds {
  Eigen::VectorXd low, high;
};

/// One run of optimize_design. Steps and gradients are by parameters times their units.
class DesignSearch {
 public:
  DesignSearch(LinkageDesign& design, const DesignOptimizerOptions& options, DesignBounds bounds);
  DesignReport run(const JobContext& context, const DesignCallback& on_step,
                   const DesignEndCallback& on_end);

 private:
  void begin_goal();
  bool step(const JobContext& context, const DesignCallback& on_step);
  [[nodiscard]] std::optional<ModelStep> worthwhile_step(const Eigen::VectorXd& slope);
  [[nodiscard]] ModelStep newton_step(const Eigen::VectorXd& slope, double left);
  [[nodiscard]] double radius_in_memory() const;
  bool judge(DesignTrial& trial, double length, double promised, bool at_rim);
  void widen(double least);
  void not_believed(const DesignTrial& trial);
  void accept(DesignPoint point, const DesignValues& values);
  bool leave_branch(const Eigen::VectorXd& parameters, DesignTrial& trial,
                    const JobContext& context);
  bool run_callback(const DesignTrial& trial, bool taken, double gradient,
                    const DesignCallback& on_step);

  void watch_guard();
  void raise_guard();
  bool lower_guard();
  void return_to_best();

  bool arrived(const std::string& message);
  bool idle(DesignStatus status, const std::string& message);
  [[nodiscard]] bool hopeless();
  bool update_multipliers();
  bool end(DesignStatus status, std::string message);
  void report_end();
  void report_remarks();

  [[nodiscard]] Eigen::VectorXd product(const Eigen::VectorXd& v);
  [[nodiscard]] Eigen::VectorXd projected(Eigen::VectorXd gradient) const;
  [[nodiscard]] double flat_energy() const;
  [[nodiscard]] double worth() const;

  LinkageDesign& design_;
  const DesignOptimizerOptions& options_;
  DesignMerit merit_;
  const DesignBounds bounds_;
  const Eigen::VectorXd units_;
  const double mean_length_, first_radius_;
  double radius_;
  double good_radius_;  // the largest since it was widened
  int goal_ = 0;        // revision of the criteria that the rest belongs to
  double first_gradient_ = 0;
  DesignValues values_;
  CurvatureMemory memory_;
  Eigen::VectorXd last_step_;  // taken or not
  int updates_ = 0, idle_ = 0;
  ViolationWatch watch_;
  int astray_ = 0;              // trials not believed more than those believed
  int paused_ = 0, pause_ = 8;  // steps without a memory, and how many next time
  int branch_attempts_ = 0;
  int branch_attempts_here_ = 0;  // since the last step that was taken
  int held_ = 0;                  // steps taken since the guard was moved
  double guarded_gradient_ = 0;   // at the first of them
  BestDesign best_;
  std::optional<DesignPoint> safe_;  // where the guard was lowered last, or kept the flat shape
  DesignReport report_;
};

}  // namespace limber::rods::detail
