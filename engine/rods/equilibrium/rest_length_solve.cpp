#include "engine/rods/equilibrium/rest_length_solve.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/rest_length_run.h"

namespace limber::rods {
namespace {

void refuse_length_option(const char* name, const char* rule, double value) {
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("{} must be {}, got {}", name, rule, value));
}

}  // namespace

void RestLengthOptions::validate() const {
  if (max_iterations <= 0) refuse_length_option("max_iterations", "> 0", max_iterations);
  if (!(tolerance > 0 && tolerance < 1)) refuse_length_option("tolerance", "in (0, 1)", tolerance);
  if (!(shortest > 0 && shortest < 1)) refuse_length_option("shortest", "in (0, 1)", shortest);
  if (!(longest > 1 && longest < 1e6)) refuse_length_option("longest", "in (1, 1e6)", longest);
}

RestLengthReport solve_rest_lengths(LinkageModel& model, LinkageState& state,
                                    const RestLengthOptions& options, const JobContext& context) {
  options.validate();
  const Eigen::VectorXd drawn = drawn_lengths(model.graph());
  for (Eigen::Index s = 0; s < drawn.size(); ++s) {
    const double share = model.segment_lengths()[s] / drawn[s];
    if (share >= options.shortest && share <= options.longest) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("lengths[{}]", s),
                fmt::format("the rest length of segment {} is {} of its drawn length, outside of "
                            "{} to {}",
                            s, share, options.shortest, options.longest));
  }
  return detail::RestLengthRun(model, state, options, context).run();
}

}  // namespace limber::rods
