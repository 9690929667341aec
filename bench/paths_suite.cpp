// Holds over more and more frames: cost of a solve and of an edit, and the form of the constraints'
// system (rows: dense in rows; frames: blocks along time). The sample flower with its own modes,
// 2000 frames; one node far from the fixed ones is held, 200 frames of a path lead there.
//
// `frames`: of the hold with its path. `cold_ms`: from rest to the optimum. `move_ms`: from a moved
// path to the optimum. `move_steps`: iterations. `missed`: largest miss in the path's frames [L].
// --quick: up to 400 frames.
#include <fmt/core.h>

#include <memory>

#include "bench/spacetime_problems.h"
#include "bench/suite.h"
#include "engine/scene/constraint_path.h"
#include "engine/spacetime/solver.h"

namespace limber::bench {
namespace {

using spacetime::PositionConstraint;

constexpr int kPathFrames = 2000, kFirstFrame = 40, kApproach = 200;

enum class Weight { kSoft, kExact };

class PathsSuite {
 public:
  PathsSuite(const SuiteOptions& options, Recorder& recorder)
      : options_(options), recorder_(recorder), problem_(sample_problem("flower", 30, recorder)) {
    problem_.timeline.frame_count = kPathFrames;
    problem_.dynamics.discretisation = spacetime::Discretisation::kSampled;
    problem_.dynamics.smoothing = 15;
    problem_.constraints.resize(1);
  }

  void run() {
    for (const Weight weight : {Weight::kSoft, Weight::kExact})
      for (const int frames : {25, 50, 100, 200, 400, 800, 1600})
        if (!options_.quick || frames <= 400) add(frames, weight);
  }

 private:
  /// [m] @param share  of the body's length to the side
  [[nodiscard]] scene::Constraint path(int frames, double share) const {
    scene::Constraint made;
    made.frame = kFirstFrame;
    const Eigen::Vector3d there(share * problem_.model->length, 0, 0);
    const int last = kFirstFrame + frames - 1;
    made.path = {{std::min(kFirstFrame + kApproach, last - 1), there}, {last, there}};
    return made;
  }

  void add(int frames, Weight weight) {
    recorder_.note(fmt::format("paths: {} frames", frames));
    const int repeats = options_.quick ? 1 : 3;
    std::vector<double> cold, move;
    spacetime::SolveReport moved;
    for (int i = 0; i < repeats; ++i) {
      auto kinematics = std::make_shared<reduced::ReducedKinematics>(problem_.model);
      const PositionConstraint held = place_constraints(problem_, *kinematics).at(0);
      const auto rows = [&](double share) {
        std::vector<PositionConstraint> made;
        const scene::Constraint wanted = path(frames, share);
        for (int frame = wanted.frame; frame <= wanted.last_frame(); ++frame) {
          PositionConstraint one = held;
          one.id = static_cast<spacetime::ConstraintId>(frame + 1);
          one.frame = frame;
          one.target = scene::target_in(wanted, frame);
          one.weight = weight == Weight::kExact ? PositionConstraint::kExact : 100;
          made.push_back(one);
        }
        return made;
      };
      spacetime::Solver solver(kinematics, problem_.dynamics, problem_.timeline);
      for (const PositionConstraint& one : rows(0.15)) solver.add(one);
      cold.push_back(milliseconds([&] { solver.solve(); }));
      move.push_back(milliseconds([&] {
        for (const PositionConstraint& one : rows(0.18)) solver.move(one.id, one.target);
        moved = solver.solve();
      }));
    }
    recorder_.note(fmt::format("  {:.4g} ms, {:.4g} ms, {} steps, {:.2g} m: {}", median(cold),
                               median(move), moved.iterations, moved.max_constraint_error,
                               moved.message));
    Case result;
    result["frames"] = frames;
    result["weight"] = weight == Weight::kExact ? "exact" : "soft";
    result["cold_ms"] = median(cold);
    result["move_ms"] = median(move);
    result["move_steps"] = moved.iterations;
    result["missed"] = moved.max_constraint_error / problem_.model->length;
    result["status"] = moved.status == spacetime::SolveStatus::kConverged ? "CONVERGED" : "NOT";
    recorder_.add(result);
  }

  const SuiteOptions& options_;
  Recorder& recorder_;
  SpacetimeProblem problem_;
};

}  // namespace

void paths_suite(const SuiteOptions& options, Recorder& recorder) {
  PathsSuite(options, recorder).run();
}

}  // namespace limber::bench
