// Beams: known answers by number of elements, and the public structures by every method.

#include <Eigen/Dense>
#include <filesystem>
#include <fstream>
#include <optional>

#include "bench/beam_evidence.h"
#include "bench/beam_live.h"
#include "bench/charted_beams.h"
#include "bench/suite.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/solver/relaxation.h"
#include "tests/support/beam_problems.h"
#include "tests/support/beam_structures.h"

namespace limber::bench {

namespace {

using beams::BeamMethod;
using testing::BeamAnswer;
using testing::BeamEnds;

beams::BeamSolveOptions options_of(BeamMethod method) {
  beams::BeamSolveOptions options;
  options.method = method;
  return options;
}

struct KnownAnswer {
  std::string name;
  std::function<BeamAnswer(int, const beams::BeamSolveOptions&)> run;
};

std::vector<KnownAnswer> known_answers() {
  std::vector<KnownAnswer> result;
  // alpha, w/L, u/L.
  const double table[][3] = {{0.2, .06636, .00265}, {0.4, .13098, .01035}, {0.6, .19235, .02249},
                             {0.8, .24945, .03817}, {1, .30172, .05643},   {1.5, .41098, .10794},
                             {2, .49346, .16064},   {3, .60325, .25442},   {4, .66996, .32894},
                             {5, .71379, .38763},   {6, .74457, .43459},   {8, .78498, .50483},
                             {10, .81061, .55500}};
  for (const auto& [alpha, w, u] : table) {
    result.push_back({"cantilever, alpha " + nlohmann::json(alpha).dump(),
                      [alpha = alpha, w = w, u = u](int n, const beams::BeamSolveOptions& o) {
                        return testing::beam_cantilever(n, alpha, w, u, o);
                      }});
  }
  const auto compressed = [](BeamEnds ends) {
    return [ends](int n, const beams::BeamSolveOptions& o) {
      return testing::beam_compressed(n, ends, .3, .399731, o);
    };
  };
  result.push_back({"elastica, hinged, span .3", compressed(BeamEnds::kHinged)});
  result.push_back({"elastica, clamped, span .3", compressed(BeamEnds::kClamped)});
  result.push_back({"roll-up to a circle", testing::beam_roll_up});
  const auto bend = [](double force, double torsion, const Eigen::Vector3d& tip) {
    return [=](int n, const beams::BeamSolveOptions& o) {
      return testing::beam_bend(n, force, torsion, tip, o);
    };
  };
  result.push_back({"45 degree bend, F 300, J 1/6", bend(300, 1.0 / 6, {58.780, 22.245, 40.189})});
  result.push_back({"45 degree bend, F 450, J 1/6", bend(450, 1.0 / 6, {52.240, 18.509, 48.500})});
  result.push_back({"45 degree bend, F 600, J 1/6", bend(600, 1.0 / 6, {47.152, 15.685, 53.472})});
  result.push_back({"45 degree bend, F 600, J .1406", bend(600, .1406, {46.894, 15.558, 53.604})});
  return result;
}

/// Iterations of Newton's method are steps too.
int steps_of(const beams::BeamReport& report) {
  return report.relaxation_steps + report.newton_iterations;
}

void run_known_answers(const SuiteOptions& options, Recorder& recorder) {
  for (const KnownAnswer& known : known_answers()) {
    for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation}) {
      for (const int elements : {10, 20, 40}) {
        // Heights are read at nodes: the middle needs one, which these numbers have.
        BeamAnswer answer;
        std::vector<double> times;
        for (int i = 0; i < (options.quick ? 1 : options.repeats); ++i)
          times.push_back(milliseconds([&] { answer = known.run(elements, options_of(method)); }));
        Case result;
        result["case"] = known.name;
        result["method"] = to_string(method);
        result["elements"] = elements;
        result["status"] = to_string(answer.report.status);
        result["error"] = answer.error;
        result["steps"] = steps_of(answer.report);
        result["wall_s"] = 1e-3 * median(times);
        recorder.add(result);
      }
    }
  }
}

struct Structure {
  const char* name;
  const char* folder;
};
constexpr Structure kStructures[] = {{"cantilever", "cantilever"},
                                     {"torus", "torus"},
                                     {"pentashell", "pentashell_pinned"},
                                     {"roof", "roof"}};

/// Microseconds of a step per node, of steps that follow each other.
double time_of_steps(const beams::BeamStructure& structure, beams::detail::ElementKernel kernel,
                     int steps) {
  const beams::BeamState start = structure.rest_state();
  beams::detail::Relaxation relaxation(structure, start, kernel);
  relaxation.set_loads(beams::NodeLoads::temporary(structure.model()) +
                       beams::NodeLoads::of(structure.model()));
  const double ms = milliseconds([&] {
    for (int i = 0; i < steps; ++i) relaxation.step();
  });
  return 1e3 * ms / steps / structure.nodes();
}

struct Outcome {
  beams::BeamSolution solution;
  double seconds = 0;
};

Outcome solve(const beams::BeamStructure& structure, BeamMethod method, int repeats) {
  Outcome outcome;
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    times.push_back(
        milliseconds([&] { outcome.solution = find_equilibrium(structure, options_of(method)); }));
  }
  outcome.seconds = 1e-3 * median(times);
  return outcome;
}

double largest_distance(const beams::BeamState& state, const Eigen::Matrix3Xd& places) {
  return (state.positions - places).colwise().norm().maxCoeff();
}

/// Root of the mean square over the nodes of `places`.
double rms_distance(const beams::BeamState& state, const Eigen::Matrix3Xd& places) {
  return std::sqrt((state.positions.leftCols(places.cols()) - places).squaredNorm() /
                   static_cast<double>(places.cols()));
}

Eigen::Matrix3Xd matrix_of(const nlohmann::json& positions) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      result(c, static_cast<Eigen::Index>(i)) =
          positions[i][static_cast<std::size_t>(c)].get<double>();
  }
  return result;
}

/// Checks whether the public positions are an equilibrium of these elements, and finds the nearest
/// one.
void add_evidence(const beams::BeamStructure& structure, const Eigen::Matrix3Xd& places,
                  const beams::BeamState& ours, Case& result) {
  const PlacesEvidence evidence = examine_places(structure, places, ours);
  result["residual_of_public"] = evidence.residual;
  result["energy_of_public"] = evidence.energy;
  result["public_moves"] = evidence.moved;
  result["energy_from_public"] = evidence.energy_after;
  result["from_public_to_ours"] = evidence.apart;
  result["from_public"] = evidence.status;
}

/// Convergence of the answers with more elements.
void add_cuts(const Structure& which, const beams::BeamModel& model, const beams::BeamState& coarse,
              const Eigen::Matrix3Xd& places, Recorder& recorder) {
  const bool counts = model.bowing == beams::Bowing::kCounts;
  for (const CutEvidence& cut : cut_finer(model, coarse, 4)) {
    Case result;
    result["case"] = std::string(which.name) + ", cut";
    result["element"] = counts ? "with bowing" : "as in the paper";
    result["parts"] = cut.parts;
    result["status"] = cut.status;
    result["energy"] = cut.energy;
    result["max_moved"] = cut.moved;
    result["rms_moved"] = cut.rms_moved;
    result["rms_from_public"] =
        std::sqrt((cut.positions - places).squaredNorm() / static_cast<double>(places.cols()));
    result["pressure"] = cut.largest_pressure;
    recorder.add(result);
  }
}

void run_structure(const Structure& which, const SuiteOptions& options,
                   const nlohmann::json& reference, Recorder& recorder) {
  const auto files = scene::read_beam_job_folder(std::filesystem::path(options.shared_folder) /
                                                 "data" / "beams" / which.folder);
  beams::BeamModel model = testing::model_of(files);
  const auto& known = reference["cases"]["shipped_" + std::string(which.folder)];
  const Eigen::Matrix3Xd places = matrix_of(known["positions"]);
  if (!options.quick || known["steps"] < 20000)
    run_charted_structure(which.name, model, places, options, recorder);
  // Reference if answers differ: the same structure with elements a third as long.
  std::optional<Outcome> fine;
  if (!options.quick)
    fine = solve(beams::BeamStructure(testing::refined(model, 3)), BeamMethod::kChoose, 1);
  const int repeats = options.quick ? 1 : std::min(options.repeats, 3);
  for (const beams::Bowing bowing : {beams::Bowing::kCounts, beams::Bowing::kLeftOut}) {
    model.bowing = bowing;
    const beams::BeamStructure structure(model);
    const Outcome relaxed = solve(structure, BeamMethod::kRelaxation, repeats);
    std::optional<Outcome> newton;  // creeps from saddle to saddle where nothing bows
    if (!options.quick || bowing == beams::Bowing::kCounts)
      newton = solve(structure, BeamMethod::kNewton, repeats);
    const Outcome chosen = solve(structure, BeamMethod::kChoose, repeats);
    std::vector<double> vector, plain;
    for (int i = 0; i < options.repeats; ++i) {
      vector.push_back(time_of_steps(structure, beams::detail::ElementKernel::kVector, 400));
      plain.push_back(time_of_steps(structure, beams::detail::ElementKernel::kPlain, 400));
    }
    Case result;
    result["case"] = which.name;
    result["element"] = bowing == beams::Bowing::kCounts ? "with bowing" : "as in the paper";
    result["nodes"] = structure.nodes();
    result["steps"] = relaxed.solution.report.relaxation_steps;
    result["us_per_node_step"] = median(vector);
    result["us_per_node_step_plain"] = median(plain);
    result["relaxation_s"] = relaxed.seconds;
    result["relaxation"] = to_string(relaxed.solution.report.status);
    if (newton) {
      result["newton_s"] = newton->seconds;
      result["newton"] = to_string(newton->solution.report.status);
      result["newton_iterations"] = newton->solution.report.newton_iterations;
    }
    result["chosen_s"] = chosen.seconds;
    result["chosen"] = to_string(chosen.solution.report.status);
    result["chosen_method"] = to_string(chosen.solution.report.method);
    result["energy_relaxation"] = relaxed.solution.report.elastic_energy;
    if (newton) result["energy_newton"] = newton->solution.report.elastic_energy;
    result["energy_chosen"] = chosen.solution.report.elastic_energy;
    result["public_s"] = known["wall_s"];
    result["public_steps"] = known["steps"];
    result["max_difference_from_public"] = largest_distance(chosen.solution.state, places);
    result["rms_from_public"] = rms_distance(chosen.solution.state, places);
    if (fine) {
      result["rms_from_refined"] =
          rms_distance(fine->solution.state, chosen.solution.state.positions);
      result["rms_of_public_from_refined"] = rms_distance(fine->solution.state, places);
      result["energy_refined"] = fine->solution.report.elastic_energy;
      result["refined"] = to_string(fine->solution.report.status);
      add_evidence(structure, places, chosen.solution.state, result);
    }
    if (bowing == beams::Bowing::kCounts)
      add_live_figures(model, repeats, options.quick ? LiveEdits::kNear : LiveEdits::kAll, result);
    recorder.add(result);
    if (!options.quick) add_cuts(which, model, chosen.solution.state, places, recorder);
  }
}

}  // namespace

void beams_suite(const SuiteOptions& options, Recorder& recorder) {
  run_known_answers(options, recorder);
  run_charted_answers(options, recorder);
  const auto reference =
      std::filesystem::path(options.shared_folder) / "reference" / "drm-structures.json";
  if (options.shared_folder.empty() || !std::filesystem::exists(reference)) {
    recorder.note("the public structures are left out: no shared folder");
    return;
  }
  if (options.quick)
    recorder.note(
        "finer structures, far live edits, what is next to the public answers, and Newton's method "
        "alone on the paper's element are left out, and the paper's chart on pentashell and roof: "
        "--quick");
  nlohmann::json document;
  std::ifstream(reference) >> document;
  for (const Structure& which : kStructures) {
    recorder.note(which.name);
    run_structure(which, options, document, recorder);
  }
}

}  // namespace limber::bench
