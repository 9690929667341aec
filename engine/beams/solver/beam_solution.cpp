#include "engine/beams/solver/beam_solution.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::beams {

namespace {

// Load steps continue as those before but for this much [rad].
constexpr double kSwerve = 0.05;
constexpr int kIterationsOfBranch = 3000;     // Newton iterations of a solve at most
constexpr double kLiveResolution = 1.0 / 64;  // of the load path
constexpr int kSmall = 250;                   // elements: fine steps take no time
// For a live edit: factorizations and steps of the relaxation times elements, about 3 s of work.
constexpr int kLiveFactorizations = 400000;
constexpr int kLeastLiveFactorizations = 100;  // at least, for any number of elements
constexpr int kLiveSteps = 10000000;           // steps times elements
constexpr int kLeastLiveSteps = 6000;          // at least, for any number of elements
// The same for any solve whose method is chosen: some 10 s, half a minute of 10,000 elements.
constexpr int kFactorizations = 2500000;
constexpr int kLeastFactorizations = 120;  // at least, for any number of elements
constexpr int kSteps = 200000000;          // steps times elements
constexpr int kLeastSteps = 10000;         // at least, for any number of elements

void require(bool holds, const char* member, double value, const char* rule) {
  if (!holds)
    throw Error(ErrorCode::kInvalidArgument, member,
                fmt::format("{} = {}, must be {}", member, value, rule));
}

}  // namespace

const char* to_string(BeamStatus status) noexcept {
  switch (status) {
    case BeamStatus::kConverged:
      return "converged";
    case BeamStatus::kStalled:
      return "stalled";
    case BeamStatus::kUnstable:
      return "unstable";
    case BeamStatus::kMechanism:
      return "mechanism";
    case BeamStatus::kIterationLimit:
      return "iteration limit";
    case BeamStatus::kCancelled:
      return "cancelled";
  }
  return "unknown";
}

const char* to_string(BeamMethod method) noexcept {
  switch (method) {
    case BeamMethod::kChoose:
      return "chosen";
    case BeamMethod::kNewton:
      return "Newton";
    case BeamMethod::kRelaxation:
      return "relaxation";
    case BeamMethod::kRelaxationThenNewton:
      return "relaxation, then Newton";
  }
  return "unknown";
}

BeamSolveOptions BeamSolveOptions::following() noexcept {
  BeamSolveOptions options;
  options.largest_swerve = kSwerve;
  options.newton_iterations = kIterationsOfBranch;
  return options;
}

BeamSolveOptions BeamSolveOptions::live(int elements) noexcept {
  BeamSolveOptions options = following();
  if (elements <= kSmall) return options;
  options.snap_resolution = kLiveResolution;
  const int size = std::max(1, elements);
  options.factorizations = std::max(kLeastLiveFactorizations, kLiveFactorizations / size);
  options.relaxation_steps =
      std::min(options.relaxation_steps, std::max(kLeastLiveSteps, kLiveSteps / size));
  return options;
}

BeamSolveOptions BeamSolveOptions::bounded_by_size(int elements) const noexcept {
  BeamSolveOptions options = *this;
  const int size = std::max(1, elements);
  if (factorizations == 0)
    options.factorizations = std::max(kLeastFactorizations, kFactorizations / size);
  options.relaxation_steps = std::min(relaxation_steps, std::max(kLeastSteps, kSteps / size));
  return options;
}

void BeamSolveOptions::validate() const {
  require(tolerance > 0 && tolerance < 1, "tolerance", tolerance, "in (0, 1)");
  require(relaxation_tolerance > 0 && relaxation_tolerance < 1, "relaxation_tolerance",
          relaxation_tolerance, "in (0, 1)");
  require(newton_iterations > 0, "newton_iterations", newton_iterations, "> 0");
  require(relaxation_steps > 0, "relaxation_steps", relaxation_steps, "> 0");
  require(ramp_steps >= 0, "ramp_steps", ramp_steps, ">= 0");
  require(first_load_step > 0 && first_load_step <= 1, "first_load_step", first_load_step,
          "in (0, 1]");
  require(hand_over > 0 && hand_over < 1, "hand_over", hand_over, "in (0, 1)");
  require(largest_swerve >= 0 && largest_swerve <= 3, "largest_swerve", largest_swerve,
          "in [0, 3]");
  require(snap_resolution > 0 && snap_resolution <= 1, "snap_resolution", snap_resolution,
          "in (0, 1]");
  require(factorizations >= 0, "factorizations", factorizations, ">= 0");
}

}  // namespace limber::beams
