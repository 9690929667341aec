// Ours against the plainly written method for the same answer, both in one run: the ratios that
// scripts/check-ratios guards. Needs no public data. One thread, CPU time, both sides in turn
// (plain_pair.h). $LIMBER_BENCH_ONLY: only pairs whose names contain it.
#include <fmt/core.h>

#include <memory>

#include "bench/literal_material.h"
#include "bench/plain_pair.h"
#include "bench/rod_kernels.h"
#include "bench/spacetime_problems.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/solver/relaxation.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/pose_sampling.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/solver/condensed_solver.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/scene/samples/samples.h"
#include "engine/session/beams/samples.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"
#include "tests/support/beam_problems.h"
#include "tests/support/charted_relaxation.h"
#include "tests/support/literal_spacetime.h"

namespace limber::bench {
namespace {

/// Pairs one after the other; the data of a pair lives as long as its measurement.
class RatioSuite {
 public:
  RatioSuite(const SuiteOptions& options, Recorder& recorder)
      : rounds_(options.quick ? 3 : std::max(5, options.repeats)), recorder_(recorder) {}

  void run() {
    if (is_selected(kFrames) || is_selected(kSolve)) frames_and_solve();
    if (is_selected(kMaterial)) material();
    if (is_selected(kHessian)) rod_hessian();
    if (is_selected(kFactor)) linkage_factor();
    if (is_selected(kRelaxation)) beam_relaxation();
    if (is_selected(kSteps)) beam_steps();
  }

 private:
  static constexpr const char* kFrames = "reconstruction of frames";
  static constexpr const char* kSolve = "space-time solve";
  static constexpr const char* kMaterial = "material";
  static constexpr const char* kHessian = "Hessian of rod elements";
  static constexpr const char* kFactor = "factor of a linkage";
  static constexpr const char* kRelaxation = "relaxation of a beam";
  static constexpr const char* kSteps = "steps of a gridshell";

  void measure(const PlainPair& pair) {
    if (!is_selected(pair.name)) return;
    recorder_.note("ratios: " + pair.name);
    recorder_.add(measure_pair(pair, rounds_));
  }

  void frames_and_solve() {
    const SpacetimeProblem problem = sample_problem("flower", 30, recorder_);
    frames(problem);
    solve(problem);
  }

  void frames(const SpacetimeProblem& problem) {
    const reduced::ReducedModel& model = *problem.model;
    const reduced::FullReconstruction full(session::map_body(scene::make_sample("flower")).body);
    const reduced::ReducedKinematics kinematics(problem.model);
    Random random(20241);
    const Eigen::MatrixXd z = reduced::sample_poses(
        {model.eigenvalues, model.modes, model.rigid_count, model.mechanism_count}, model.length,
        reduced::ModelOptions{}.amplitude, reduced::PoseLevels::kTest, 16, random);
    const Eigen::MatrixXd linear = model.modes * z;
    Eigen::MatrixXf q;
    // Norms of shapes, without the product by B on ours: clients do that. It has orthonormal
    // columns, so that q has the same norm.
    measure({kFrames, "coordinates of the reduced model, as streamed, 16 poses",
             "full rotation-strain shapes: a pass over the tets and a solve for each pose",
             [&] {
               kinematics.coordinates(0, z, q);
               return (model.basis * q.col(0).cast<double>()).norm();
             },
             [&] {
               Eigen::VectorXd u, first;
               for (Eigen::Index i = 0; i < z.cols(); ++i) {
                 full.from_linear(Eigen::VectorXd(linear.col(i)), u);
                 if (i == 0) first = u;
               }
               return first.norm();
             },
             0.01});
  }

  void solve(const SpacetimeProblem& problem) {
    constexpr double kTolerance = 1e-4;  // of the scaled gradient, as in the suite `spacetime`
    const auto fresh = [&] { return std::make_shared<reduced::ReducedKinematics>(problem.model); };
    measure({kSolve, "cold solve of z, flower",
             "Gauss-Newton on all frames and modes with CHOLMOD (literal_spacetime.h)",
             [&] {
               spacetime::SolverOptions options;
               options.gradient_tolerance = kTolerance;
               const auto kinematics = fresh();
               const auto constraints = place_constraints(problem, *kinematics);
               spacetime::Solver solver(kinematics, problem.dynamics, problem.timeline, options);
               for (const auto& constraint : constraints) solver.add(constraint);
               return solver.solve().total_energy;
             },
             [&] {
               spacetime::SolverOptions options;
               options.gradient_tolerance = kTolerance;
               options.max_iterations = 1000;
               const auto kinematics = fresh();
               const auto constraints = place_constraints(problem, *kinematics);
               testing::LiteralSpacetime method(kinematics, problem.dynamics, problem.timeline,
                                                constraints, options);
               return method.solve_cold().total_energy;
             },
             1e-6});
  }

  void material() {
    constexpr int kMaterialCoordinates = 80;
    const SpacetimeProblem problem = sample_problem("flower", kMaterialCoordinates, recorder_);
    const auto kinematics = std::make_shared<reduced::ReducedKinematics>(problem.model);
    const auto constraints = place_constraints(problem, *kinematics);
    const spacetime::Material start{
        problem.dynamics,
        spacetime::first_coordinates(problem.model->coordinate_count(),
                                     static_cast<int>(problem.dynamics.stiffness.size()))};
    const double slow = spacetime::slow_frequency_of(
        problem.dynamics,
        reduced::reference_mode(problem.model->coordinate_count(), problem.model->rigid_count,
                                problem.model->mechanism_count));
    measure(
        {kMaterial, "joint steps of z, Lambda and D until they settle, flower",
         "the paper's alternation, 30 rounds (literal_material.h)",
         [&] {
           spacetime::MaterialOptions options;
           options.variables = spacetime::MaterialVariables::kMotionAndDynamics;
           options.slow_frequency = slow;
           spacetime::Solver solver(kinematics, start.dynamics, problem.timeline, {}, start.mixing);
           for (const auto& constraint : constraints) solver.add(constraint);
           solver.solve();
           spacetime::MaterialSolver joint(kinematics, problem.timeline, solver.constraint_set(),
                                           start, solver.motion(), options);
           return joint.solve().total_energy;
         },
         [&] {
           LiteralMaterialOptions options;
           options.variables = spacetime::MaterialVariables::kMotionAndDynamics;
           options.slow_frequency = slow;
           return literal_material(kinematics, problem.timeline, constraints, start, options)
               .total_energy;
         },
         0.01});
  }

  /// The kernel's own clock: the least of many calls, of an element in one lane and in all.
  void rod_hessian() {
    recorder_.note(std::string("ratios: ") + kHessian);
    std::vector<double> ours, plain, ratios;
    for (int i = 0; i < rounds_; ++i) {
      const RodKernelTimes times = time_rod_kernels(64, 20);
      ours.push_back(times.element_hessian_pack);
      plain.push_back(times.element_hessian_scalar);
      ratios.push_back(plain.back() / ours.back());
    }
    Case result;
    result["pair"] = kHessian;
    result["ratio"] = median(ratios);
    result["ratio_least"] = quantile(ratios, 0);
    result["ratio_most"] = quantile(ratios, 1);
    result["ours_cpu_ms"] = 1e-6 * median(ours);
    result["plain_cpu_ms"] = 1e-6 * median(plain);
    result["rounds"] = rounds_;
    result["difference"] = nullptr;  // the same template, checked by the tests of rods
    result["ours"] = "blocks of an element, several elements at once, a vertex";
    result["plain"] = "the same template with one number for a lane";
    recorder_.add(result);
  }

  void linkage_factor() {
    const rods::LinkageGraph graph =
        rods::build_linkage_graph(scene::make_linkage_sample("hyperboloid").lines);
    const rods::LinkageModel model(graph, 20, {1e4, 1.0, 2.0, 0.5});  // N, m
    const rods::LinkageState state(model);
    rods::LinkageAssembly assembly(model);
    rods::CondensedMatrix matrix(model.chains());
    Eigen::VectorXd gradient(model.variables().size());
    (void)assembly.hessian(state, gradient, matrix);
    Eigen::SparseMatrix<double> whole = matrix.to_sparse();
    double shift = 1e-9 * whole.coeffs().cwiseAbs().maxCoeff();
    rods::CondensedSolver solver(model.chains());
    while (!solver.factor(matrix, shift).positive_definite()) shift *= 4;
    for (Eigen::Index i = 0; i < whole.rows(); ++i) whole.coeffRef(i, i) += shift;
    whole.makeCompressed();
    SparseCholesky cholmod;
    cholmod.analyse(whole);
    const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(whole.rows(), -1, 2);
    measure({kFactor, "segments condensed, joints factored, and a solve: hyperboloid, 20 edges",
             "supernodal CHOLMOD on the whole Hessian, and a solve",
             [&] {
               (void)solver.factor(matrix, shift);
               Eigen::VectorXd x = right;
               solver.solve_in_place(x);
               return x.norm();
             },
             [&] {
               cholmod.refactor(whole);
               return cholmod.solve(right).norm();
             },
             1e-5});
  }

  void beam_relaxation() {
    const beams::BeamModel model = testing::cantilever_model(10, 1);
    beams::BeamModel chord = model;  // the paper's element does not bow
    chord.bowing = beams::Bowing::kLeftOut;
    const testing::ChartedStructure charted(chord);
    const beams::BeamStructure structure(model);
    testing::ChartedOptions paper;
    paper.residual = 1e-6;
    paper.rest_energy = 1e-26;
    beams::BeamSolveOptions relaxed;
    relaxed.method = beams::BeamMethod::kRelaxation;
    measure(
        {kRelaxation, "cantilever of 10 elements at rest, alpha 1",
         "the paper's relaxation in its chart of the normal (charted_relaxation.h)",
         [&] { return find_equilibrium(structure, relaxed).state.positions.rightCols(1).norm(); },
         [&] {
           const auto found = relax_charted(charted, paper);
           return found.unknowns.topRows<3>().rightCols(1).norm();
         },
         0.002});
  }

  void beam_steps() {
    const beams::BeamStructure structure(session::make_beam_sample("gridshell").model);
    const auto steps = [&](beams::detail::ElementKernel kernel) {
      constexpr int kCount = 200;
      beams::detail::Relaxation relaxation(structure, structure.rest_state(), kernel);
      relaxation.set_loads(beams::NodeLoads::temporary(structure.model()) +
                           beams::NodeLoads::of(structure.model()));
      for (int i = 0; i < kCount; ++i) relaxation.step();
      return relaxation.state().positions.norm();
    };
    measure({kSteps, "200 steps of relaxation, several elements at once",
             "the same, one element after the other",
             [&] { return steps(beams::detail::ElementKernel::kVector); },
             [&] { return steps(beams::detail::ElementKernel::kPlain); }, 1e-6});
  }

  int rounds_;
  Recorder& recorder_;
};

}  // namespace

void ratios_suite(const SuiteOptions& options, Recorder& recorder) {
  const int before = thread_count();
  set_thread_count(1);
  RatioSuite(options, recorder).run();
  set_thread_count(before);
}

}  // namespace limber::bench
