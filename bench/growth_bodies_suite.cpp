// How times of bodies grow with tets, frames, modes and constraints, one at a time. Rows: `growth`
// is the parameter that grows, `size` its value, `what` is timed, `ms` its median.
//
// `tets`: bars of 3 x 1 x 1 m (bar_body.h), models of 30 modes, 60 columns and 20 fitted tets.
// `frames`, `modes`, `constraints`: a path problem of the flower (path_problem.h), h = 80, with 400
// frames, 20 modes and 10 constraints for those that do not grow. A target is moved by 2 % of the
// body's length. Solves that did not converge are counted in `not_converged`.
#include <fmt/core.h>

#include <map>

#include "bench/bar_body.h"
#include "bench/growth_rows.h"
#include "bench/path_problem.h"
#include "bench/suite.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"
#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/solver.h"

namespace limber::bench {
namespace {

void grow_tets(const SuiteOptions& options, Recorder& recorder) {
  const std::vector<int> cells =
      options.quick ? std::vector<int>{3, 4, 6, 8} : std::vector<int>{4, 6, 8, 11, 14};
  for (const int count : cells) {
    const bodies::ElasticBody body = bar_body(count);
    const double tets = body.mesh.tet_count();
    recorder.note(fmt::format("growth_bodies: {} tets", tets));
    reduced::ModelOptions requested;
    requested.basis_size = 60;
    requested.cubature_size = 20;
    reduced::ReducedModel built;
    const double build = milliseconds([&] { built = reduced::build_model(body, requested); });
    recorder.add(growth_row("tets", tets, "build of a model", build));
    recorder.add(growth_row("tets", tets, "modes", 1e3 * built.report.modes_s));
    const auto model = std::make_shared<const reduced::ReducedModel>(std::move(built));
    const reduced::FullReconstruction full(body);
    const Eigen::VectorXd z = 0.05 * Eigen::VectorXd::LinSpaced(model->modes.cols(), 1, -0.5);
    const Eigen::VectorXd linear = model->modes * z;
    const reduced::ReducedKinematics kinematics(model);
    const Eigen::MatrixXd many = z.replicate(1, 256);
    Eigen::VectorXd u;
    Eigen::MatrixXf q;
    std::vector<double> full_ms, reduced_ms;
    for (int i = 0; i < options.repeats; ++i) {
      full_ms.push_back(milliseconds([&] { full.from_linear(linear, u); }));
      reduced_ms.push_back(milliseconds([&] { kinematics.coordinates(0, many, q); }) /
                           double(many.cols()));
    }
    recorder.add(growth_row("tets", tets, "full shape of a frame", median(full_ms)));
    recorder.add(growth_row("tets", tets, "reduced coordinates of a frame", median(reduced_ms)));
  }
}

/// A solver's life: opened, then one target after the other moved.
class GrowingProblem {
 public:
  GrowingProblem(NamedBody named, const SuiteOptions& options, Recorder& recorder)
      : named_(std::move(named)), options_(options), recorder_(recorder) {}

  void run(const char* growth, double size, const PathShape& shape) {
    recorder_.note(fmt::format("growth_bodies: {} {}", size, growth));
    const SpacetimeProblem problem = path_problem(named_, model_of(shape.modes), shape);
    const auto kinematics = std::make_shared<reduced::ReducedKinematics>(problem.model);
    const auto constraints = place_constraints(problem, *kinematics);
    // If targets cannot be met, a full solve at full weight may need all its iterations.
    int not_converged = 0;
    const bool is_large = shape.frames > 20000;
    std::vector<double> cold;
    std::unique_ptr<spacetime::Solver> solver;
    const int repeats = is_large ? 1 : 3;
    cold.reserve(static_cast<std::size_t>(repeats));
    for (int i = 0; i < repeats; ++i) {
      cold.push_back(milliseconds([&] {
        solver =
            std::make_unique<spacetime::Solver>(kinematics, problem.dynamics, problem.timeline);
        for (const auto& constraint : constraints) solver->add(constraint);
        not_converged += solve_counts(*solver);
      }));
    }
    recorder_.add(growth_row(growth, size, "cold solve", median(cold), not_converged));
    not_converged = 0;
    std::vector<double> first, frames, converged;
    Eigen::MatrixXf q;
    for (int i = 0; i < (is_large ? 3 : 2 + options_.repeats); ++i) {
      const auto& moved = constraints[static_cast<std::size_t>(i * 7) % constraints.size()];
      const Eigen::Vector3d by(std::cos(2.4 * i), std::sin(2.4 * i), std::cos(7.2 * i));
      first.push_back(milliseconds([&] {
        solver->move(moved.id, moved.target + 0.02 * kinematics->length() * by.normalized());
        solver->correct();
        static_cast<void>(solver->motion());
      }));
      const double shapes = milliseconds([&] { kinematics->coordinates(0, solver->motion(), q); });
      frames.push_back(first.back() + shapes);
      converged.push_back(first.back() + milliseconds([&] {
                            not_converged += solve_counts(*solver);
                            static_cast<void>(solver->motion());
                          }));
    }
    recorder_.add(growth_row(growth, size, "first motion after an edit", median(first)));
    recorder_.add(growth_row(growth, size, "all frames of it", median(frames)));
    recorder_.add(
        growth_row(growth, size, "converged after an edit", median(converged), not_converged));
  }

 private:
  static int solve_counts(spacetime::Solver& solver) {
    return solver.solve().status == spacetime::SolveStatus::kConverged ? 0 : 1;
  }

  /// All its modes are unknowns: r = R.
  std::shared_ptr<const reduced::ReducedModel> model_of(int modes) {
    auto& model = models_[modes];
    if (!model) {
      reduced::ModelOptions requested;
      requested.mode_count = modes;
      requested.basis_size = 80;
      requested.cubature_size = 32;
      model = std::make_shared<const reduced::ReducedModel>(
          reduced::build_model(named_.body, requested));
    }
    return model;
  }

  NamedBody named_;
  const SuiteOptions& options_;
  Recorder& recorder_;
  std::map<int, std::shared_ptr<const reduced::ReducedModel>> models_;
};

}  // namespace

void growth_bodies_suite(const SuiteOptions& options, Recorder& recorder) {
  grow_tets(options, recorder);
  recorder.note("growth_bodies: the flower's model");
  GrowingProblem problem(body_of_scene(scene::make_sample("flower")), options, recorder);
  const PathShape usual{400, 10, 20};
  const auto grown = [&](int PathShape::*member, int size) {
    PathShape shape = usual;
    shape.*member = size;
    return shape;
  };
  std::vector<int> frames{100, 300, 1000, 3000, 10000};
  if (!options.quick) frames.insert(frames.end(), {30000, 100000});
  for (const int size : frames) problem.run("frames", size, grown(&PathShape::frames, size));
  for (const int size : {10, 20, 40, 80})
    problem.run("modes", size, grown(&PathShape::modes, size));
  for (const int size : {5, 10, 20, 40, 80})
    problem.run("constraints", size, grown(&PathShape::constraints, size));
}

}  // namespace limber::bench
