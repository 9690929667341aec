#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "engine/base/job.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/linkage/halved_linkage.h"
#include "engine/rods/linkage/linkage_stresses.h"

namespace limber::rods {

/// An equilibrium against the limit of ever finer edges, estimated from the one with half edges.
/// All forms of bending are of second order: halving removes three quarters of the error.
struct DiscretisationError {
  /// Largest distance of a joint, a free end or a vertex from its place in the limit [length]. Also
  /// the segment where that is, with the joint at its nearer end (-1: none).
  double max_distance = 0;
  int worst_segment = 0;
  int worst_joint = -1;
  /// Error of the elastic energy, relative to that of the limit; 0 if there is none.
  double energy_error = 0;
  int edges = 0;           // of all segments of the given linkage
  int compared_edges = 0;  // and of the one with half edges
  int iterations = 0;      // Newton steps from the one to the other
  /// For each segment: change of its elastic energy by halving [force length].
  Eigen::VectorXd energy_changes;
  /// Error of the largest stress of a segment (largest_stresses): the greatest error of all
  /// segments, its segment, and its share of the largest stress of all. Empty: not requested.
  struct Stress {
    double error = 0;  // [force/length^2]
    double share = 0;
    int segment = 0;
  };
  std::optional<Stress> stress;
  /// Why there is no estimate; empty: there is one.
  std::string message;

  [[nodiscard]] bool is_known() const { return message.empty(); }
};

/// Estimates errors of equilibria of one linkage, again and again: the model with half edges and
/// its symbolic factorisation stay. Not from several threads at once.
class DiscretisationEstimator {
 public:
  /// @param model     its graph, edges, stiffness and form; sizes may change
  /// @param stresses  of its rods; empty: errors of stresses are not estimated
  explicit DiscretisationEstimator(const LinkageModel& model,
                                   std::optional<LinkageStressModel> stresses = {});

  /// Solves for the equilibrium with half edges that is near to the given one.
  /// @param model       as in the constructor, with the sizes of the shape
  /// @param state       an equilibrium
  /// @param conditions  that it is in equilibrium under; pins without positions hold where it is
  /// @throws Error{kCancelled}, and as LinkageEquilibrium::solve
  [[nodiscard]] DiscretisationError estimate(const LinkageModel& model, const LinkageState& state,
                                             const Conditions& conditions,
                                             const JobContext& job = {});

 private:
  [[nodiscard]] DiscretisationError::Stress stress_error(const LinkageModel& model,
                                                         const LinkageState& state,
                                                         const LinkageState& halved) const;

  HalvedLinkage halved_;
  std::optional<LinkageStressModel> stresses_;
  LinkageEquilibrium equilibrium_;
};

}  // namespace limber::rods
