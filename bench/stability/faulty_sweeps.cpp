// Rows that are faulty on purpose, for the test of the suite itself ($LIMBER_STABILITY_FAULTS).

#include <chrono>
#include <csignal>
#include <limits>
#include <stdexcept>
#include <thread>

#include "bench/stability/sweep.h"
#include "engine/base/error.h"

namespace limber::bench::stability {
namespace {

Sweep faulty(const char* name, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "faults";
  sweep.name = name;
  sweep.parameter = "none";
  sweep.asked = "to be found";
  sweep.check = "the suite's own";
  sweep.values = {1};
  sweep.run = std::move(run);
  sweep.seconds = 0.5;
  return sweep;
}

}  // namespace

Sweeps faulty_sweeps() {
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  return {
      faulty("right",
             [](double) {
               return Finding{Claim::kConverged, 1e-3, 1e-2};
             }),
      faulty("wrong",
             [](double) {
               return Finding{Claim::kConverged, 2e-2, 1e-2};
             }),
      faulty("no number",
             [](double) {
               return Finding{Claim::kConverged, kNoNumber, 1e-2};
             }),
      faulty("not finite",
             [](double) {
               return Finding{Claim::kNotConverged, 0, 1e-2, false, "stalled"};
             }),
      faulty("said so",
             [](double) {
               return Finding{Claim::kNotConverged, 1, 1e-2, true, "stalled"};
             }),
      faulty("silent",
             [](double) {
               return Finding{Claim::kNotConverged, 1, 1e-2};
             }),
      faulty("refused",
             [](double) -> Finding { throw Error(ErrorCode::kInvalidArgument, "x", "too hard"); }),
      faulty("thrown", [](double) -> Finding { throw std::runtime_error("no Error"); }),
      faulty("hang",
             [](double) -> Finding {
               for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
             }),
      faulty("crash",
             [](double) -> Finding {
               std::signal(SIGSEGV, SIG_DFL);
               std::raise(SIGSEGV);
               return {};
             }),
  };
}

}  // namespace limber::bench::stability
