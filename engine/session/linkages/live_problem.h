#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/session/linkages/equilibrium_cache.h"
#include "engine/session/linkages/mapping.h"
#include "engine/session/linkages/pin_reach.h"
#include "engine/session/linkages/recalled_answer.h"
#include "engine/session/linkages/rod_sizes.h"
#include "engine/session/linkages/shape.h"
#include "engine/session/linkages/statics.h"

namespace limber::session {

/// A linkage that is kept in equilibrium: what the task of a session works with. Driven by one
/// thread.
class LiveLinkage {
 public:
  /// @throws Error as map_linkage and rest_shape, with a field of the scene
  explicit LiveLinkage(const scene::Linkage& linkage, const JobContext& job = {});

  [[nodiscard]] const rods::LinkageModel& model() const { return mapped_.model; }
  [[nodiscard]] const LinkageShape& shape() const { return shape_; }
  /// With the sizes of the shape's rods; another object where those are others.
  [[nodiscard]] const std::shared_ptr<const LinkageStatics>& statics() const { return statics_; }
  /// Conditions that the shape is in equilibrium under; nothing where it is in none.
  [[nodiscard]] std::shared_ptr<const scene::LinkageConditions> settled_under() const {
    return settled_under_;
  }
  /// Conditions of the last equilibrium.
  [[nodiscard]] const rods::Conditions& held() const { return good_held_; }
  /// The same with the sizes it has, as a scene would have them.
  [[nodiscard]] scene::LinkageConditions conditions_of_shape() const;
  [[nodiscard]] double length_unit() const { return length_unit_; }  // [m]
  /// Sizes of the rods in the scene.
  [[nodiscard]] const RodSizes& first_sizes() const { return first_sizes_; }
  /// As the model has them.
  [[nodiscard]] const RodSizes& sizes() const { return sizes_; }
  /// The shape as drawn, in equilibrium under nothing yet.
  [[nodiscard]] const rods::LinkageState& drawn() const { return drawn_; }
  /// The shape now: of the last iterate.
  [[nodiscard]] const rods::LinkageState& state() const { return iterate_ ? *iterate_ : state_; }

  struct Outcome {
    bool reached = false;            // an equilibrium under these conditions
    rods::EquilibriumReport report;  // of the last solve; counts are sums
    /// The equilibria along the path, the last included, and their coordinates and strains (see
    /// LinkageStatics).
    std::vector<rods::DeploymentStep> path;
    std::vector<Eigen::VectorXd> frames;
    std::vector<Eigen::VectorXf> strains;
    rods::EquilibriumReport path_end;  // of the last of them, where the path was followed in steps
  };
  /// Called now and then with a shape along the path: no equilibrium yet.
  using OnIterate = std::function<void()>;

  /// The equilibrium under these conditions, followed from the present shape. It is followed step
  /// by step (rods::deploy) if angles and pins have far to go, or if the shape moves far. If it is
  /// not reached, the shape is the last equilibrium along the path, or the one before; after a
  /// cancellation, it is the last iterate. The first solve begins in the shape of the scene, if it
  /// has one. If there is no equilibrium near that, it begins with the drawing, and the message
  /// reports it. Conditions that were solved before are not solved again if they are the very same
  /// object, as undo restores it. The outcome is then the earlier one, in every digit of its shape
  /// and report (no steps were made, and no path). Cancelled solves have none, and another
  /// LiveLinkage, such as one of more edges, knows none of them.
  /// @pre there are conditions
  /// @param origins  where undo or redo led here: the conditions before these in the history, the
  /// nearest first. Conditions that were not solved then, because later edits came sooner, begin
  /// from the nearest of them that was, as when their edit had been waited for
  Outcome solve(const std::shared_ptr<const scene::LinkageConditions>& conditions,
                const JobContext& job, const OnIterate& on_iterate,
                const std::vector<std::shared_ptr<const scene::LinkageConditions>>& origins = {});
  /// An equilibrium under conditions that were not solved yet, found elsewhere (by a design): their
  /// solve begins there, as where they had been solved before.
  void add_guess(const std::shared_ptr<const scene::LinkageConditions>& conditions,
                 const rods::LinkageState& state);
  /// Takes the scene's shape as the answer to these conditions: they are not solved again, like
  /// those that undo restores. @returns false, and nothing has changed, if the scene has no unused
  /// shape, or if the shape is no equilibrium under its stated conditions
  bool recall(const std::shared_ptr<const scene::LinkageConditions>& conditions,
              const RecalledAnswer& answer);
  /// Back to the last equilibrium that was reached.
  void restore();
  /// A newer edit has interrupted the last solve. If the shape is far from the last equilibrium,
  /// returns to that one: a solve that continues from here would not notice that it has left its
  /// branch. The shown shape still continues from the iterate.
  void stay_near();
  /// Edits take longer than a screen shows a picture.
  [[nodiscard]] bool is_slow() const { return model().variables().size() >= kSlowUnknowns; }
  /// The report on that one where another was not reached: its energies and balance, with the
  /// status, the counts and the message of the attempt.
  [[nodiscard]] rods::EquilibriumReport report_of_shape(
      const rods::EquilibriumReport& attempt) const;

 private:
  /// A shape that one solve has turned so far might have left its branch [rad].
  static constexpr double kFarTurn = 0.2;
  static constexpr int kSlowUnknowns = 2000;

  using SharedConditions = std::shared_ptr<const scene::LinkageConditions>;
  using Answer = EquilibriumCache::Answer;
  void come_back_to(const CachedEquilibrium& answer);
  [[nodiscard]] Outcome cached_outcome(const SharedConditions& conditions, const Answer& answer);
  [[nodiscard]] Answer good_answer() const;
  [[nodiscard]] Outcome attempt_from_here(const SharedConditions& conditions, const JobContext& job,
                                          const OnIterate& on_iterate);
  void note_reached(const SharedConditions& conditions, const Outcome& outcome);
  void note_stopped(const SharedConditions& conditions, Outcome& outcome);
  void attempt(const scene::LinkageConditions& conditions, const rods::Conditions& target,
               const RodSizes& sizes, const JobContext& job, const OnIterate& on_iterate,
               Outcome& outcome);
  [[nodiscard]] std::string contradiction(const scene::LinkageConditions& conditions) const;
  [[nodiscard]] RodSizes sizes_of(const scene::LinkageConditions& conditions) const;
  void set_sizes(const RodSizes& sizes);
  void refuse_turned_over(rods::EquilibriumReport& report);
  [[nodiscard]] bool follow_to(const RodSizes& target, const JobContext& job,
                               const OnIterate& on_iterate, Outcome& outcome);
  [[nodiscard]] bool open_with(const RodSizes& target, const scene::LinkageConditions& conditions,
                               const JobContext& job, const OnIterate& on_iterate,
                               Outcome& outcome);
  [[nodiscard]] bool begin_in_shape(const scene::LinkageConditions& conditions,
                                    const JobContext& job, Outcome& outcome);
  [[nodiscard]] bool bring_sizes(const RodSizes& target, const scene::LinkageConditions& conditions,
                                 const rods::Conditions& then_held, const JobContext& job,
                                 const OnIterate& on_iterate, Outcome& outcome);
  [[nodiscard]] double share_of_step(const rods::Conditions& target) const;
  void go(const rods::Conditions& target, const JobContext& job, const OnIterate& on_iterate,
          Outcome& outcome);
  void go_straight(const rods::Conditions& target, const JobContext& job,
                   const OnIterate& on_iterate, Outcome& outcome);
  void go_again(const rods::Conditions& target, const JobContext& job, const OnIterate& on_iterate,
                Outcome& outcome);
  [[nodiscard]] bool is_erected_by(const scene::LinkageConditions& conditions,
                                   const rods::Conditions& target, std::string& remark) const;
  [[nodiscard]] std::vector<rods::JointLoad> push_here(
      const scene::LinkageErection& erection) const;
  [[nodiscard]] std::string describe_shape_reached(const scene::LinkageConditions& conditions,
                                                   const rods::LinkageState& before,
                                                   Outcome& outcome) const;
  [[nodiscard]] Outcome open_with_push(const scene::LinkageConditions& conditions,
                                       const rods::Conditions& target, double factor,
                                       const JobContext& job, const OnIterate& on_iterate);
  [[nodiscard]] bool erect(const scene::LinkageConditions& conditions,
                           const rods::Conditions& target, const JobContext& job,
                           const OnIterate& on_iterate, Outcome& outcome, std::string& remark);
  void note_step(const rods::LinkageState& state, Outcome& outcome) const;
  [[nodiscard]] bool show_ahead(const scene::LinkageConditions& conditions, const JobContext& job,
                                const OnIterate& on_iterate);
  void lead(const rods::Conditions& target, double step, const JobContext& job,
            const OnIterate& on_iterate, Outcome& outcome);

  MappedLinkage mapped_;
  rods::LinkageState state_;  // before what follows: it may bring the model other rest lengths
  const rods::LinkageState drawn_;
  LinkageShape shape_;
  const scene::Linkage linkage_;
  const PinReach reach_;
  const RodSizes first_sizes_;  // as the scene has them
  RodSizes sizes_;              // of the model
  std::shared_ptr<const LinkageStatics> statics_;
  double length_unit_, extent_;
  rods::LinkageEquilibrium equilibrium_;
  rods::LinkageState good_;
  RodSizes good_sizes_;
  SharedConditions settled_under_;
  Answer reached_;  // the last equilibrium that was requested and reached
  SharedConditions reached_under_;
  bool settled_ = false;        // is good_ an equilibrium
  rods::Conditions held_;       // the last that state_ was in equilibrium under
  rods::Conditions good_held_;  // those of good_
  rods::EquilibriumReport good_report_;
  const rods::LinkageState* iterate_ = nullptr;  // within a solve
  /// The shape that is shown while edits come faster than equilibria. It follows the edits by
  /// itself, with a factor of its own, and no solve starts from it. Empty: the shape is shown.
  std::optional<rods::LinkageState> ahead_;
  std::optional<rods::LinkageEquilibrium> ahead_steps_;  // made when it is needed first
  EquilibriumCache cache_;
  bool in_shape_ = false;  // that of the scene, which nothing has begun in yet
  double turned_ = 0;      // by the interrupted solves since state_ was an equilibrium [rad]
};

}  // namespace limber::session
