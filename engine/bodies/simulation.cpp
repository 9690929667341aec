#include "engine/bodies/simulation.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"

namespace limber::bodies {
namespace {

constexpr int kMostHalvings = 10;

[[noreturn]] void refuse_simulation(ErrorCode code, const std::string& field,
                                    const std::string& message) {
  throw Error(code, field, field + " " + message);
}

void check(const Loads& loads, int node_count) {
  if (!loads.gravity.allFinite())
    refuse_simulation(ErrorCode::kInvalidArgument, "gravity", "must be finite");
  for (std::size_t i = 0; i < loads.forces.size(); ++i) {
    const PointForce& load = loads.forces[i];
    const std::string field = fmt::format("forces[{}]", i);
    if (load.nodes.empty())
      refuse_simulation(ErrorCode::kInvalidArgument, field + ".nodes",
                        "must name at least one node");
    for (const int node : load.nodes) {
      if (node < 0 || node >= node_count) {
        refuse_simulation(ErrorCode::kOutOfRange, field + ".nodes",
                          fmt::format("has node {}, the mesh has {}", node, node_count));
      }
    }
    if (!load.force.allFinite())
      refuse_simulation(ErrorCode::kInvalidArgument, field + ".force", "must be finite");
    if (!(load.until > load.from)) {
      refuse_simulation(ErrorCode::kInvalidArgument, field + ".until",
                        fmt::format("= {:g} must be > from = {:g}", load.until, load.from));
    }
    if (load.profile == ForceProfile::kRamp && !std::isfinite(load.until))
      refuse_simulation(ErrorCode::kInvalidArgument, field + ".until", "must be finite for a ramp");
    if (load.profile == ForceProfile::kSine &&
        (!(load.period > 0) || !std::isfinite(load.period))) {
      refuse_simulation(ErrorCode::kInvalidArgument, field + ".period",
                        fmt::format("= {:g} must be > 0 and finite", load.period));
    }
  }
}

/// Integral of a force's profile over its first `t` seconds [s].
double impulse_factor(const PointForce& load, double t) {
  switch (load.profile) {
    case ForceProfile::kConstant:
      break;
    case ForceProfile::kRamp:
      return t * t / (2 * (load.until - load.from));
    case ForceProfile::kSine: {
      const double turn = 2 * std::numbers::pi / load.period;
      return (1 - std::cos(turn * t)) / turn;
    }
  }
  return t;
}

/// Forces as functions of time.
class LoadHistory {
 public:
  LoadHistory(const FullDynamics& dynamics, const Loads& loads)
      : weight_(dynamics.mass() * loads.gravity.replicate(dynamics.mass().rows() / 3, 1)),
        loads_(loads) {}

  /// The mean over [begin, begin + length]: short blows are not missed between steps.
  [[nodiscard]] const Eigen::VectorXd& mean(double begin, double length) {
    mean_ = weight_;
    for (const PointForce& load : loads_.forces) {
      const double first = std::max(begin, load.from), last = std::min(begin + length, load.until);
      if (last <= first) continue;
      const double acts =
          impulse_factor(load, last - load.from) - impulse_factor(load, first - load.from);
      const Eigen::Vector3d share =
          acts / length / static_cast<double>(load.nodes.size()) * load.force;
      for (const int node : load.nodes) mean_.segment<3>(3 * node) += share;
    }
    return mean_;
  }

 private:
  Eigen::VectorXd weight_, mean_;
  const Loads& loads_;
};

class Run {
 public:
  Run(FullDynamics& dynamics, LoadHistory& loads, Simulation& result, const JobContext& job)
      : dynamics_(dynamics), loads_(loads), result_(result), job_(job) {}

  void advance(double begin, double length, int halvings = 0) {
    job_.throw_if_cancelled();
    const Eigen::VectorXd& force = loads_.mean(begin, length);
    const Eigen::VectorXd before = dynamics_.state().displacement;
    const StepReport report = dynamics_.step(force, length);
    result_.newton_steps += report.newton_steps;
    if (report.status == StepReport::Status::kConverged) {
      ++result_.steps;
      work_ += force.dot(dynamics_.state().displacement - before);
      return;
    }
    if (halvings == kMostHalvings) {
      throw Error(ErrorCode::kNumerical, "",
                  fmt::format("the simulation fails at {:.6g} s: even a step of {:.3g} s does not "
                              "converge. Stiffer material, more damping or smaller loads may help",
                              begin, length));
    }
    if (halvings == 0) ++result_.shortened_steps;
    advance(begin, length / 2, halvings + 1);
    advance(begin + length / 2, length / 2, halvings + 1);
  }

  /// The state as this frame of the result.
  void record(int frame) {
    const Eigen::VectorXd& u = dynamics_.state().displacement;
    result_.displacements.col(frame) = u;
    result_.kinetic[frame] = dynamics_.kinetic_energy();
    result_.elastic[frame] = dynamics_.elastic_energy();
    result_.work[frame] = work_;
    const auto worst = dynamics_.elasticity().worst_inversion(u);
    if (worst.smallest < result_.smallest_volume_ratio) {
      result_.smallest_volume_ratio = worst.smallest;
      result_.smallest_frame = frame;
      result_.smallest_tet = worst.tet;
    }
  }

 private:
  FullDynamics& dynamics_;
  LoadHistory& loads_;
  Simulation& result_;
  const JobContext& job_;
  double work_ = 0;  // of the loads [J]
};

}  // namespace

void SimulationOptions::validate() const {
  const auto demand = [](bool ok, const char* field, double value, const char* rule) {
    if (!ok)
      refuse_simulation(ErrorCode::kInvalidArgument, field,
                        fmt::format("= {:g} must be {}", value, rule));
  };
  demand(frame_count >= 1, "frame_count", frame_count, ">= 1");
  demand(std::isfinite(frames_per_second) && frames_per_second > 0, "frames_per_second",
         frames_per_second, "> 0 and finite");
  demand(steps_per_frame >= 1, "steps_per_frame", steps_per_frame, ">= 1");
  dynamics.validate();
}

Simulation simulate(const ElasticBody& body, const Loads& loads, const DynamicState& initial,
                    const SimulationOptions& options, const JobContext& job) {
  options.validate();
  check(loads, body.mesh.node_count());
  job.report("analysing the system", 0);
  DynamicsOptions stepping = options.dynamics;
  stepping.time_step = 1 / (options.frames_per_second * options.steps_per_frame);
  FullDynamics dynamics(body, stepping);
  DynamicState state = initial;
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  if (state.displacement.size() == 0) state.displacement = zero;
  if (state.velocity.size() == 0) state.velocity = zero;
  dynamics.set_state(std::move(state));

  Simulation result;
  result.displacements.resize(zero.size(), options.frame_count);
  result.kinetic.resize(options.frame_count);
  result.elastic.resize(options.frame_count);
  result.work.resize(options.frame_count);
  LoadHistory history(dynamics, loads);
  Run run(dynamics, history, result, job);
  run.record(0);
  for (int frame = 1; frame < options.frame_count; ++frame) {
    job.report("simulating", static_cast<double>(frame) / options.frame_count);
    const double begin = (frame - 1) / options.frames_per_second;
    for (int part = 0; part < options.steps_per_frame; ++part)
      run.advance(begin + part * stepping.time_step, stepping.time_step);
    run.record(frame);
  }
  if (result.smallest_volume_ratio <= 0) {
    result.message = fmt::format(
        "tets are turned inside out (worst: tet {} in frame {}): St. Venant-Kirchhoff "
        "material collapses under strong compression; results there are not physical",
        result.smallest_tet, result.smallest_frame);
  }
  return result;
}

}  // namespace limber::bodies
