#pragma once

#include <IpTNLP.hpp>

#include <deque>
#include <optional>

#include "bench/design_trace.h"
#include "bench/ipopt_design.h"
#include "engine/rods/design/design_merit.h"

namespace limber::bench {

/// A design in the form that Ipopt needs. The variables x are parameters over their mean length; J,
/// with the guard's part of the flat energy, is over J of the start; constraints >= 0. Trials begin
/// from the iterate of the last derivatives, as the optimiser's do.
class IpoptProgram final : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  /// Why a round ended, if it did not end by itself.
  enum class Interruption {
    kNone,
    kTime,
    kGuardHinders,  // it weighs as much as the objective
    kFlatLost,      // next to no step is left that the flat shape survives
  };

  /// @param seconds  of the trace, after which rounds end
  IpoptProgram(rods::LinkageDesign& design, const rods::DesignOptimizerOptions& options,
               double seconds, DesignTrace& trace);

  /// From where the design stands.
  /// @param held  iterations before the guard is options whether it hinders
  void begin_round(const rods::detail::GuardWeight& guard, int held);
  [[nodiscard]] Interruption interruption() const { return interruption_; }
  [[nodiscard]] const rods::DesignValues& values() const { return here_.values; }
  /// Measure of the guard. If it is below rounding, the size of energies replaces it.
  [[nodiscard]] double flat_energy() const;
  /// Elsewhere, where it has stood.
  void return_to(const rods::DesignPoint& point);
  [[nodiscard]] const IpoptReport& report() const { return report_; }

  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian,
                    IndexStyleEnum& style) override;
  bool get_bounds_info(Index n, Number* low, Number* high, Index m, Number* least,
                       Number* most) override;
  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override;
  bool eval_f(Index n, const Number* x, bool, Number& objective) override;
  bool eval_g(Index n, const Number* x, bool, Index, Number* rooms) override;
  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override;
  bool eval_jac_g(Index n, const Number* x, bool, Index m, Index, Index* rows, Index* columns,
                  Number* values) override;
  bool eval_h(Index n, const Number* x, bool, Number objective_factor, Index,
              const Number* multipliers, bool, Index, Index* rows, Index* columns,
              Number* values) override;
  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number, Number, Number,
                             Number length, Number, Number, Number share, Index,
                             const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override;
  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*,
                         Index, const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  struct Evaluation {
    Eigen::VectorXd x;
    std::optional<rods::DesignPoint> point;  // empty: not believed
    rods::DesignValues values;
  };
  const Evaluation& see(const Eigen::VectorXd& x);
  void remember(Evaluation evaluation);
  bool stand_at(const Eigen::VectorXd& x);
  [[nodiscard]] Eigen::MatrixXd hessian(double objective, double flatness, double angle);

  rods::LinkageDesign& design_;
  const rods::DesignOptimizerOptions& options_;
  const double seconds_;
  DesignTrace& trace_;
  const Eigen::VectorXd start_;
  const double unit_, flatness_allowed_;
  double objective_unit_ = 1;
  rods::detail::GuardWeight guard_;
  int held_ = 0;
  int rounds_iterations_ = 0;  // of the rounds before
  Interruption interruption_ = Interruption::kNone;
  Evaluation here_;                                // where the design stands
  std::deque<Evaluation> evaluations_;             // of late, elsewhere
  rods::LostShape lost_ = rods::LostShape::kNone;  // by the last trial that was not believed
  IpoptReport report_;
};

}  // namespace limber::bench
