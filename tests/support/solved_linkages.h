#pragma once

#include <optional>

#include "engine/rods/equilibrium/discretisation_error.h"

namespace limber::rods::testing {

/// An equilibrium of a linkage, and what it is held by.
struct SolvedLinkage {
  LinkageModel model;
  LinkageState state;
  Conditions conditions;
  bool is_found = false;  // else the state is where the search stopped
};

/// As drawn, to its equilibrium.
[[nodiscard]] SolvedLinkage solved_linkage(LinkageModel model, const Conditions& conditions);

// Rods with known answers, as linkages: bending stiffness 1, stretching none that shows.

/// A rod along x from a joint that holds it, where another one crosses, to a joint at x = 1, where
/// the end of a third one hangs and a force of `alpha` pulls aside.
[[nodiscard]] SolvedLinkage cantilever_linkage(int edges, double alpha, BendingForm form);
/// A rod that passes corners of a regular hexagon of perimeter 1, where the ends of others hang: a
/// ring of energy 2 pi^2.
[[nodiscard]] SolvedLinkage ring_linkage(int edges, BendingForm form);
/// A rod of length 1 between two joints that hold it, brought to 0.3 of that; others cross there.
[[nodiscard]] SolvedLinkage elastica_linkage(int edges, BendingForm form);

struct TrueLinkageError {
  double distance = 0;  // the largest of a joint or a vertex [length]
  double energy = 0;    // relative
};
/// Against edges an eighth as long, of the equilibrium next to it. Nothing: there is none.
[[nodiscard]] std::optional<TrueLinkageError> true_error(const SolvedLinkage& given);
/// What DiscretisationEstimator says.
[[nodiscard]] DiscretisationError estimate_of(const SolvedLinkage& given);

}  // namespace limber::rods::testing
