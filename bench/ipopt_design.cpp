#include "bench/ipopt_design.h"

#include <IpIpoptApplication.hpp>

#include "bench/ipopt_program.h"
#include "engine/base/error.h"
#include "engine/rods/design/design_merit.h"

namespace limber::bench {
namespace {

std::string describe(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Solved_To_Acceptable_Level:
      return "converged";
    case Ipopt::Infeasible_Problem_Detected:
      return "infeasible";
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return "direction too small";
    case Ipopt::User_Requested_Stop:
      return "out of time";
    case Ipopt::Maximum_Iterations_Exceeded:
      return "out of iterations";
    case Ipopt::Restoration_Failed:
      return "restoration failed";
    case Ipopt::Error_In_Step_Computation:
      return "no step";
    case Ipopt::Invalid_Number_Detected:
      return "cannot be evaluated";
    default:
      return "status " + std::to_string(status);
  }
}

void set_options(Ipopt::IpoptApplication& application, IpoptHessian hessian) {
  const auto options = application.Options();
  // Ends with its time.
  options->SetNumericValue("tol", 1e-12);
  options->SetIntegerValue("acceptable_iter", 0);
  options->SetIntegerValue("max_iter", 1000000);
  options->SetStringValue("nlp_scaling_method", "none");  // units are the program's
  // Bounds are hardly ever active: a barrier with a considerable weight leads away from the
  // optimum.
  options->SetStringValue("mu_strategy", "monotone");
  options->SetNumericValue("mu_init", 1e-6);
  if (hessian == IpoptHessian::kLimitedMemory) {
    options->SetStringValue("hessian_approximation", "limited-memory");
    options->SetIntegerValue("limited_memory_max_history", 30);
  }
  constexpr const char* kNoFile = "";
  if (application.Initialize(kNoFile) != Ipopt::Solve_Succeeded)
    throw Error(ErrorCode::kInternal, "", "Ipopt does not take its options");
}

}  // namespace

IpoptReport ipopt_design(rods::LinkageDesign& design, const rods::DesignOptimizerOptions& options,
                         const IpoptChoice& choice, double seconds, DesignTrace& trace) {
  using Interruption = IpoptProgram::Interruption;
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  set_options(*application, choice.hessian);
  const Ipopt::SmartPtr<IpoptProgram> program = new IpoptProgram(design, options, seconds, trace);
  const Ipopt::SmartPtr<Ipopt::TNLP> problem = Ipopt::GetRawPtr(program);
  rods::detail::GuardWeight guard;
  if (choice.guarded) guard.raise_at_once(program->values().objective, program->flat_energy());
  rods::DesignPoint safe = design.point();
  int rounds = 0;
  std::string end;
  while (end.empty()) {
    ++rounds;
    program->begin_round(guard, choice.held);
    const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(problem);
    const Interruption why = program->interruption();
    if (why == Interruption::kTime) {
      end = "out of time";
    } else if (why == Interruption::kFlatLost) {
      program->return_to(safe);
      if (!guard.raise(program->values().objective, program->flat_energy())) end = "flat lost";
    } else if (guard.weight() > 0) {
      safe = design.point();
      guard.lower();
    } else {
      end = describe(status);
    }
  }
  IpoptReport report = program->report();
  report.rounds = rounds;
  report.end = end;
  return report;
}

}  // namespace limber::bench
