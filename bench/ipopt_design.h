#pragma once

#include <string>

#include "bench/design_trace.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::bench {

enum class IpoptHessian {
  kLimitedMemory,  // L-BFGS of Ipopt's
  kExact,          // of the Lagrangian, dense: a product for each parameter
};

struct IpoptChoice {
  IpoptHessian hessian = IpoptHessian::kLimitedMemory;
  /// Against buckling: by weights of the flat energy as optimize_design has them, one after the
  /// other, each in a round of its own from where the last one ended.
  bool guarded = true;
  int held = 8;  // iterations of a round, at least
};

struct IpoptReport {
  int iterations = 0;
  int rounds = 0;
  int trials = 0;        // requested equilibria of other parameters
  int not_believed = 0;  // of them: lost, jumped or too far
  int newton_steps = 0;  // of both equilibria, over all trials
  int products = 0;
  std::string end;  // Ipopt's message
};

/// A design by Ipopt: least J with 1 - c / allowed >= 0 and alpha_min - asked >= 0, by parameters
/// over their mean length. Their bounds are the same shares of the start's as in optimize_design. A
/// trial whose equilibria are not believed is one that cannot be evaluated: Ipopt shortens its
/// step.
/// @param design  where the search begins; of lengths alone; stands at its last iterate afterwards
/// @param seconds  CPU time of this thread after which it is stopped
/// @param trace  gets each iterate, the start first
/// @throws Error{kInternal} where Ipopt does not begin
IpoptReport ipopt_design(rods::LinkageDesign& design, const rods::DesignOptimizerOptions& options,
                         const IpoptChoice& choice, double seconds, DesignTrace& trace);

}  // namespace limber::bench
