// Our search for designs against Ipopt's: the problems of `limber-bench design`, with the same
// criteria, bounds and constraints, from the same start. Ours goes first, for 200 steps. Ipopt has
// the same time, with L-BFGS and, if there are few parameters, with exact second derivatives; the
// same with our guard against buckling has twice that. A second run of ours shows the noise. One
// thread each, by its CPU time.
//
// `rms_*`: distance of the joints from the target, root mean square, of the best design until a
// quarter, half, all and twice the CPU time of our search. `rms_200`: after 200 iterations. The
// best keeps both constraints and has the least objective of those that do. Trials are requested
// equilibria of other parameters, not_believed those of them that were lost or had jumped; rounds
// are weights of the guard.
//
// Built where Ipopt is: apt-get install coinor-libipopt-dev.
#include <fmt/core.h>

#include "bench/design_trace.h"
#include "bench/ipopt_design.h"
#include "bench/known_designs.h"
#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/base/parallel.h"

namespace limber::bench {
namespace {

constexpr int kOurSteps = 200, kOurQuickSteps = 20;
// Iterations with one weight of the guard, at least: L-BFGS has to forget its data of the previous
// weight.
constexpr int kExactHeld = 3, kMemoryHeld = 15;
constexpr int kFewParameters = 300;  // exact second derivatives are a product for each

/// One model: each search begins from the same start.
class Contest {
 public:
  Contest(const LinkageCase& named, const std::string& path, int steps)
      : name_(named.name),
        problem_(open_design(named, path)),
        known_(known_design(problem_, kPerturbed)),
        steps_(steps) {}

  [[nodiscard]] Eigen::Index parameters() const { return problem_.start.lengths.size(); }

  /// The reference for the times of the others.
  Case ours() {
    rods::LinkageDesign design = design_towards(known_, problem_);
    const rods::DesignOptimizerOptions search = known_search(design, steps_);
    DesignTrace trace(design, search);
    rods::DesignReport report;
    const double wall = milliseconds([&] {
      report = rods::optimize_design(
          design, search, {}, [&](const rods::DesignProgress& progress, rods::LinkageDesign& at) {
            if (progress.iteration == 1) trace.note(0, at.values(problem_.start));
            trace.note(progress.iteration, progress.values);
          });
    });
    const double seconds = trace.seconds();
    if (unit_ == 0) unit_ = seconds;
    Case result = begun("ours");
    result["iterations"] = report.iterations;
    result["rounds"] = 1;
    result["trials"] = report.iterations;
    result["not_believed"] = report.not_believed;
    result["newton_steps"] = report.newton_steps;
    result["products"] = report.products;
    add_figures(result, trace, search, seconds, wall);
    result["end"] =
        report.status == rods::DesignStatus::kIterationLimit ? "out of iterations" : report.message;
    return result;
  }

  Case ipopt(const IpoptChoice& choice) {
    rods::LinkageDesign design = design_towards(known_, problem_);
    const rods::DesignOptimizerOptions search = known_search(design, steps_);
    DesignTrace trace(design, search);
    IpoptReport report;
    const double given = choice.guarded ? 2 * unit_ : unit_;
    const double wall =
        milliseconds([&] { report = ipopt_design(design, search, choice, given, trace); });
    const double seconds = trace.seconds();
    const bool exact = choice.hessian == IpoptHessian::kExact;
    Case result = begun(
        fmt::format("Ipopt, {}{}", exact ? "exact" : "L-BFGS", choice.guarded ? ", guard" : ""));
    result["iterations"] = report.iterations;
    result["rounds"] = report.rounds;
    result["trials"] = report.trials;
    result["not_believed"] = report.not_believed;
    result["newton_steps"] = report.newton_steps;
    result["products"] = report.products;
    add_figures(result, trace, search, seconds, wall);
    result["end"] = report.end;
    return result;
  }

 private:
  Case begun(const std::string& search) const {
    Case result;
    result["model"] = name_;
    result["parameters"] = parameters();
    result["search"] = search;
    return result;
  }

  void add_figures(Case& result, const DesignTrace& trace,
                   const rods::DesignOptimizerOptions& options, double seconds, double wall) const {
    const auto rms = [&](const DesignTrace::Best& best) { return trace.distance(best.values); };
    const double before = rms(trace.best_after(0)), after = rms(trace.best());
    result["cpu_s"] = seconds;
    result["wall_s"] = wall / 1000;
    result["target_rms_before"] = before;
    result["rms_quarter"] = rms(trace.best_at(unit_ / 4));
    result["rms_half"] = rms(trace.best_at(unit_ / 2));
    result["rms_all"] = rms(trace.best_at(unit_));
    result["rms_twice"] = rms(trace.best_at(2 * unit_));
    result["rms_200"] = rms(trace.best_after(kOurSteps));
    result["target_rms_after"] = after;
    result["factor"] = before / after;
    result["objective"] = trace.best().values.objective;
    result["constraints_kept"] = trace.best().rank.holds();
    result["flatness"] = trace.flat_height(trace.best().values);
    result["flatness_asked"] = options.flat_height;
    result["min_angle"] = trace.best().values.smallest_angle / kDegree;
    result["min_angle_asked"] = options.smallest_angle / kDegree;
  }

  const char* name_;
  DesignProblem problem_;
  KnownDesign known_;
  int steps_;
  double unit_ = 0;  // CPU seconds of our search
};

void compare_searches(const LinkageCase& named, const std::string& path,
                      const SuiteOptions& options, Recorder& recorder) {
  const auto tell = [&](const std::string& what) {
    recorder.note(fmt::format("design_ipopt: {}: {}", named.name, what));
  };
  tell("opens, and moves to a known design");
  Contest contest(named, path, options.quick ? kOurQuickSteps : kOurSteps);
  if (options.quick && contest.parameters() > kFewParameters) {
    tell("left out where little time is");
    return;
  }
  tell("ours");
  recorder.add(contest.ours());
  for (const IpoptHessian hessian : {IpoptHessian::kLimitedMemory, IpoptHessian::kExact}) {
    const bool exact = hessian == IpoptHessian::kExact;
    if (exact && contest.parameters() > kFewParameters) continue;
    for (const bool guarded : {true, false}) {
      tell(fmt::format("Ipopt, {} second derivatives{}", exact ? "exact" : "L-BFGS's",
                       guarded ? ", guarded" : ""));
      recorder.add(contest.ipopt({hessian, guarded, exact ? kExactHeld : kMemoryHeld}));
    }
  }
  tell("ours, again");
  recorder.add(contest.ours());
}

}  // namespace

void design_ipopt_suite(const SuiteOptions& options, Recorder& recorder) {
  const int threads = thread_count();
  set_thread_count(1);
  for_each_design(options, recorder, [&](const LinkageCase& named, const std::string& path) {
    compare_searches(named, path, options, recorder);
  });
  set_thread_count(threads);
}

}  // namespace limber::bench
