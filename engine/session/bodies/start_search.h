#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/base/job.h"
#include "engine/session/bodies/mode_chooser.h"
#include "engine/session/bodies/start_comparison.h"

namespace limber::session {

struct StartRequest {
  std::shared_ptr<const BodyResult> result;  // exact, at the end of its solve
  std::shared_ptr<const reduced::ReducedModel> model;
  std::shared_ptr<const BodyParts> body;
  ModeProblem problem;
  int modes = 0;   // r, elastic
  int starts = 0;  // StartSearchOptions::starts_within
};

struct StartFinding {
  StartComparison comparison;
  Eigen::MatrixXd motion;  // z of a better end than the result's; empty: there is none
};

/// Solves one problem with the full map from several starts: from rest, and with its constraints
/// added one by one in several orders. The choice of orders depends on the problem alone, neither
/// on clocks nor on earlier solves.
/// @throws Error{kCancelled}
[[nodiscard]] StartFinding search_starts(const StartRequest& request,
                                         const spacetime::SolverOptions& solver,
                                         const JobContext& job);

enum class ShownStart { kLowest, kBefore };

/// A sentence on a search that found other optima or starts that did not converge; empty where all
/// starts end in the same one.
/// @param length_unit  of the scene [m]
[[nodiscard]] std::string describe_starts(const StartComparison& comparison, double length_unit,
                                          ShownStart shown = ShownStart::kLowest);

}  // namespace limber::session
