// Every hard case of every wing, made harder decade by decade until something fails: the task, the
// outcome, and its margin. An answer that claims convergence is checked by code that it does not
// share with the solver; each row is a process of its own, with a wall limit.
//
// `$LIMBER_BENCH_ONLY`: only sweeps whose "wing: name" contains it. `$LIMBER_STABILITY_EDITS`:
// edits of the longest session, 1e5 unless given. `$LIMBER_STABILITY_FAULTS`: rows that are faulty
// on purpose instead, to see that the suite finds them.
#include <fmt/core.h>

#include <map>

#include "bench/stability/isolated.h"
#include "bench/stability/sweep.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

using stability::Outcome;
using stability::Sweep;

constexpr double kRowSeconds = 60;  // wall limit of a row that has none of its own
constexpr int kFailuresInARow = 2;  // beyond them a sweep is over
constexpr int kQuickRows = 2;

std::vector<Sweep> all_sweeps() {
  using namespace stability;
  if (wants_faults()) return faulty_sweeps();
  std::vector<Sweep> all;
  for (const auto wing :
       {modal_sweeps, dynamics_sweeps, reconstruction_sweeps, model_sweeps, exact_sweeps,
        linear_motion_sweeps, bent_motion_sweeps, recovery_sweeps, rod_sweeps, linkage_sweeps,
        linkage_angle_sweeps, beam_sweeps, beam_branch_sweeps, edit_sweeps}) {
    for (Sweep& sweep : wing()) all.push_back(std::move(sweep));
  }
  return all;
}

Case number_or_null(const std::optional<double>& value) { return value ? Case(*value) : Case(); }

Case row_of(const Sweep& sweep, std::size_t index, const stability::Ended& ended) {
  const stability::Verdict verdict = verdict_of(ended);
  Case row;
  row["wing"] = sweep.wing;
  row["case"] = sweep.name;
  row["parameter"] = sweep.parameter;
  row["value"] = sweep.values[index];
  row["asked"] = sweep.asked;
  row["check"] = sweep.check;
  row["required"] = static_cast<int>(index) < sweep.required;
  row["outcome"] = to_string(verdict.outcome);
  row["error"] = number_or_null(verdict.error);
  row["margin"] = number_or_null(verdict.margin);
  row["seconds"] = ended.seconds;
  row["reason"] = verdict.reason;
  return row;
}

/// Sums of rows.
struct Count {
  int rows = 0, faults = 0, missed = 0;
};

void run(const Sweep& sweep, const SuiteOptions& options, Recorder& recorder, Count& count) {
  int failures = 0;
  for (std::size_t i = 0; i < sweep.values.size() && failures < kFailuresInARow; ++i) {
    if (options.quick && i >= kQuickRows) break;
    const double value = sweep.values[i];
    const stability::Ended ended = stability::run_isolated(
        [&] { return sweep.run(value); }, sweep.seconds > 0 ? sweep.seconds : kRowSeconds);
    const Outcome outcome = verdict_of(ended).outcome;
    const Case row = row_of(sweep, i, ended);
    recorder.add(row);
    recorder.note(row.dump(-1, ' ', false, Case::error_handler_t::replace));
    ++count.rows;
    if (is_fault(outcome)) ++count.faults;
    if (outcome == Outcome::kCertified) {
      failures = 0;
    } else {
      ++failures;
      if (static_cast<int>(i) < sweep.required) ++count.missed;
    }
  }
}

}  // namespace

void stability_suite(const SuiteOptions& options, Recorder& recorder) {
  Count count;
  for (const Sweep& sweep : all_sweeps())
    if (is_selected(sweep.wing + ": " + sweep.name)) run(sweep, options, recorder, count);
  recorder.note(fmt::format("stability: {} rows, {} faults, {} required ones not certified",
                            count.rows, count.faults, count.missed));
  if (count.faults > 0)
    throw Refuted(fmt::format("stability: {} rows are wrong, hang or crash", count.faults));
}

}  // namespace limber::bench
