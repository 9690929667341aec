// One Newton iteration of a linkage, part by part, against supernodal CHOLMOD on the whole Hessian.
#include <fmt/core.h>

#include <Eigen/SparseCore>

#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/solver/condensed_solver.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::bench {
namespace {

struct Model {
  const char* file;
  int edges;
  rods::RodStiffness stiffness;  // in N and mm
};

constexpr Model kModels[] = {
    {"burd_flat_opt_scaled", 10, {6750, 5062.5, 316.4, 386.3}},
    {"etienne_hyperboloid_measured", 10, {30000, 250000, 5625, 7836}},
    {"darth_vader_pavilion", 10, {2340000, 32955000, 15795000, 13920760}},
    {"AsymmOverhanging2BumpsArchitecturalScale", 10, {192000, 2304000, 1024000, 925198}},
    {"hourglass", 8, {192000, 2304000, 1024000, 925198}},
};

template <class Work>
double median_ms(int repeats, const Work& work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) times.push_back(milliseconds(work));
  return median(times);
}

/// The drawn shape with a little noise, in the unknowns' own sizes.
rods::LinkageState noisy_state(const rods::LinkageModel& model) {
  Random random(11);
  const double edge = model.rest_lengths().free_edge.mean();
  Eigen::VectorXd increment = Eigen::VectorXd::Zero(model.variables().size());
  for (int j = 0; j < model.variables().joints(); ++j) {
    const int begin = model.variables().joint_begin(j);
    for (int k = 0; k < 3; ++k) increment[begin + k] = 1e-3 * edge * random.normal();
    for (int k = 3; k < 7; ++k) increment[begin + k] = 1e-2 * random.normal();
  }
  return rods::LinkageState(model).moved(model, increment);
}

/// A shift that makes the Hessian safely positive definite, as a Newton iteration would.
double sufficient_shift(rods::CondensedSolver& solver, const rods::CondensedMatrix& matrix,
                        double scale) {
  double shift = 1e-9 * scale;
  while (!solver.factor(matrix, shift).positive_definite()) shift *= 4;
  return shift;
}

Case measure(const Model& named, const std::string& path, int threads, int repeats) {
  const rods::LinkageGraph graph = rods::build_linkage_graph(scene::read_line_mesh_file(path));
  const rods::LinkageModel model(graph, named.edges, named.stiffness,
                                 rods::BendingForm::kMaterialFrames);
  const rods::LinkageState state = noisy_state(model);
  set_thread_count(threads);
  rods::LinkageAssembly assembly(model);
  rods::CondensedMatrix matrix(model.chains());
  Eigen::VectorXd gradient(model.variables().size());
  (void)assembly.hessian(state, gradient, matrix);

  const double analysis = milliseconds([&] { const rods::CondensedSolver fresh(model.chains()); });
  rods::CondensedSolver solver(model.chains());
  Eigen::SparseMatrix<double> whole = matrix.to_sparse();
  const double shift = sufficient_shift(solver, matrix, whole.coeffs().cwiseAbs().maxCoeff());
  Case result;
  result["model"] = named.file;
  result["dofs"] = model.variables().size();
  result["segments"] = model.variables().segments();
  result["joints"] = model.variables().joints();
  result["threads"] = threads;
  result["analysis_ms"] = analysis;
  result["hessian_ms"] =
      median_ms(repeats, [&] { (void)assembly.hessian(state, gradient, matrix); });
  result["factorization_ms"] = median_ms(repeats, [&] { (void)solver.factor(matrix, shift); });
  Eigen::VectorXd x = gradient;
  result["solve_ms"] = median_ms(repeats, [&] { solver.solve_in_place(x); });
  result["move_ms"] = median_ms(repeats, [&] { (void)state.moved(model, 1e-6 * gradient); });
  result["energy_ms"] = median_ms(repeats, [&] { (void)assembly.energies(state); });

  for (Eigen::Index i = 0; i < whole.rows(); ++i) whole.coeffRef(i, i) += shift;
  whole.makeCompressed();
  SparseCholesky cholmod;
  result["cholmod_analysis_ms"] = milliseconds([&] { cholmod.analyse(whole); });
  result["cholmod_factorization_ms"] =
      median_ms(std::min(repeats, 9), [&] { cholmod.refactor(whole); });
  const Eigen::VectorXd expected = cholmod.solve(gradient);
  x = gradient;
  solver.solve_in_place(x);
  result["difference"] = (x - expected).norm() / expected.norm();
  return result;
}

}  // namespace

void linkage_solver_suite(const SuiteOptions& options, Recorder& recorder) {
  const int before = thread_count();
  for (const Model& named : kModels) {
    const auto path = find_linkage_lines(options, named.file, named.file, recorder);
    if (!path) continue;
    for (const int threads : {1, 2})
      recorder.add(measure(named, *path, threads, options.quick ? 9 : 8 * options.repeats + 1));
  }
  set_thread_count(before);
}

}  // namespace limber::bench
