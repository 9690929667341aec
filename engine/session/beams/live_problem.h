#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/refinement/subdivision_choice.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/session/beams/analysis.h"
#include "engine/session/beams/conditions.h"
#include "engine/session/beams/discretisation_check.h"

namespace limber::session {

/// For one shape, 7 float32 a node: x, y, z [m], then the rotation from rest as a unit quaternion
/// w, x, y, z.
[[nodiscard]] Eigen::VectorXd beam_coordinates(const beams::BeamState& state);

/// A structure of beams that is kept in equilibrium: what the task of a session works with. Driven
/// by one thread.
///
/// Elements may be cut into parts (BeamDiscretisation): shapes, answers and nodes of reports are of
/// the structure as it came.
class LiveBeams {
 public:
  /// @param shape  where the first solve begins; none: as drawn
  /// @throws Error as beams::validate and BeamDiscretisation::validate; {kInvalidArgument, "shape"}
  /// for a shape of other numbers of nodes or hinged ends
  explicit LiveBeams(beams::BeamModel model, std::optional<beams::BeamState> shape = {},
                     beams::BeamDiscretisation discretisation = {});

  /// The shape now: the last equilibrium or, within a solve, the last point of the path.
  [[nodiscard]] beams::BeamState state() const { return shown(state_); }
  /// Analysis of the last equilibrium; null before the first.
  [[nodiscard]] const std::shared_ptr<const BeamAnalysis>& analysis() const {
    return good_.analysis;
  }

  struct Outcome {
    bool reached = false;  // an equilibrium under these conditions
    /// If an edit was not reached, load_factor is the share of the change up to which there is an
    /// equilibrium, and the message begins with it.
    beams::BeamReport report;
    /// Shapes along the path, the equilibrium last; empty where it was not reached.
    std::vector<Eigen::VectorXd> frames;
  };
  /// Called with states along the path: load steps, or now and then of the relaxation.
  using OnIterate = std::function<void(const beams::BeamState& state)>;

  /// The equilibrium under these conditions. The first equilibrium starts from the structure as
  /// drawn, under its own temporary loads until one is found, or near the given shape, which
  /// selects the buckling direction. Later ones are followed from the current shape
  /// (beams::follow_equilibrium), never from the drawn one. If none is reached, the shape is the
  /// previous one; after a cancellation, it is the last point of the path. Conditions that were
  /// solved before, the very same object as undo brings them back, begin from the shape they had
  /// then. A shape to begin from that was not solved to its end, cancelled or interrupted, is still
  /// there to begin from. If a tolerance chooses the parts, a solve that fails because elements are
  /// too long is repeated with shorter ones.
  Outcome solve(const std::shared_ptr<const BeamConditions>& conditions, const JobContext& job,
                const OnIterate& on_iterate);
  /// Estimates the discretisation error of the last equilibrium. If a tolerance chooses the parts
  /// and fewer suffice, the next solve begins with these. Else shorter elements judge its
  /// stability: the report of analysis() may change.
  /// @pre there is one
  /// @throws Error{kCancelled}
  [[nodiscard]] std::shared_ptr<const DiscretisationCheck> check(const JobContext& job);
  /// The same equilibrium with more parts where the last check found that the error comes from.
  /// @returns whether there is one now; the limits of the discretisation may allow none
  /// @throws Error{kCancelled}
  bool refine(const JobContext& job);
  /// Back to the last equilibrium, or to where it began.
  void restore();

 private:
  using SharedConditions = std::shared_ptr<const BeamConditions>;
  using Turns = std::vector<beams::HeldTurn>;
  struct Place {
    SharedConditions conditions;  // null: as drawn
    beams::Subdivision cut;
    beams::BeamState state;  // of the cut model
    Turns turned;
    std::shared_ptr<const BeamAnalysis> analysis;
  };
  /// @returns whether they were solved before
  bool begin_at(const SharedConditions& conditions);
  void keep(const SharedConditions& conditions, beams::BeamStructure&& structure,
            beams::BeamSolution&& solution);
  void judge(const JobContext& job);
  void keep_path_state(const BeamConditions& conditions, const beams::BeamSolution& solution);
  [[nodiscard]] beams::BeamSolution settle(const beams::BeamStructure& structure,
                                           beams::FoundUnder found, const JobContext& job,
                                           const beams::BeamObserver& observer) const;
  [[nodiscard]] Outcome solve_once(const SharedConditions& conditions, const JobContext& job,
                                   const OnIterate& on_iterate);
  [[nodiscard]] Outcome solve_as_drawn(const SharedConditions& conditions, const JobContext& job,
                                       const OnIterate& on_iterate);
  [[nodiscard]] Turns turns_at(const BeamConditions& conditions, double share) const;
  /// The state there is, with other parts.
  void set_cut(const beams::Subdivision& cut);
  /// Without nodes between parts.
  [[nodiscard]] beams::BeamState shown(const beams::BeamState& state) const;
  /// Nodes of the structure in place of those between parts.
  void name_nodes(beams::BeamReport& report) const;

  const beams::BeamModel model_;
  const beams::BeamDiscretisation discretisation_;
  beams::Subdivision cut_;
  beams::BeamState state_;  // of the cut model
  Turns turned_;            // of the held nodes in state_
  bool is_drawn_ = true;    // nothing has moved yet
  Place good_;              // the last equilibrium
  // The shape to begin from, whose balance is not known; none after a solve from it.
  std::optional<Place> given_;
  // The latest last. Conditions without other owners are dropped: no weak pointers to them exist.
  std::deque<Place> known_;
  std::optional<beams::DiscretisationEstimate> estimate_;  // of good_
  std::optional<beams::Subdivision> next_cut_;             // that the next solve begins with
};

}  // namespace limber::session
