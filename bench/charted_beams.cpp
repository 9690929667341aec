#include "bench/charted_beams.h"

#include <cmath>

#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_problems.h"
#include "tests/support/charted_relaxation.h"

namespace limber::bench {

namespace {

using beams::BeamModel;
using testing::BeamEnds;
using testing::ChartedOptions;
using testing::ChartedResult;
using testing::ChartedStructure;
using testing::ChartedUnknowns;

constexpr const char* kMethod = "the paper's chart";

struct ChartedAnswer {
  std::string name;
  std::function<BeamModel(int)> model;
  std::function<double(const ChartedUnknowns&)> error;
  ChartedOptions options;
};

/// Options for structures whose length and stiffness are of the size of 1.
ChartedOptions unit_options() {
  ChartedOptions options;
  options.residual = 1e-6;
  options.rest_energy = 1e-26;
  return options;
}

std::function<double(const ChartedUnknowns&)> distance_of_tip(const Eigen::Vector3d& place,
                                                              double length) {
  return [=](const ChartedUnknowns& u) {
    return (u.col(u.cols() - 1).head<3>() - place).norm() / length;
  };
}

/// Lengths in another unit; forces stay as they are.
BeamModel in_unit(BeamModel model, double unit) {
  for (beams::BeamNode& node : model.nodes) node.position /= unit;
  for (beams::BeamSection& section : model.sections) {
    section.torsion /= unit * unit;
    section.bending_2 /= unit * unit;
    section.bending_3 /= unit * unit;
  }
  return model;
}

ChartedAnswer cantilever(double alpha, double deflection, double shortening) {
  return {"cantilever, alpha " + nlohmann::json(alpha).dump(),
          [alpha](int n) { return testing::cantilever_model(n, alpha); },
          distance_of_tip({1 - shortening, 0, deflection}, 1), unit_options()};
}

ChartedAnswer compressed(const std::string& name, BeamEnds ends) {
  // Slow enough not to buckle into waves, the load on until the ends have come: else it does.
  ChartedOptions options = unit_options();
  options.motion_from = 0;
  options.temporary_until = options.motion_until = options.slower_from = 200000;
  return {name, [ends](int n) { return testing::compressed_model(n, ends, .3); },
          [](const ChartedUnknowns& u) {
            return std::abs(u.row(2).cwiseAbs().maxCoeff() - .399731) / .399731;
          },
          options};
}

ChartedAnswer bend(double force, const Eigen::Vector3d& tip, double unit) {
  constexpr double kLength = 78.539816339744831;
  ChartedOptions options = unit_options();
  options.residual *= force;
  return {"45 degree bend, F " + nlohmann::json(static_cast<int>(force)).dump() + ", J 1/6" +
              (unit == 1 ? "" : ", lengths over 100"),
          [=](int n) { return in_unit(testing::bend_model(n, force, 1.0 / 6), unit); },
          distance_of_tip(tip / unit, kLength / unit), options};
}

std::vector<ChartedAnswer> charted_answers() {
  return {cantilever(0.2, .06636, .00265),
          cantilever(1, .30172, .05643),
          cantilever(4, .66996, .32894),
          cantilever(10, .81061, .55500),
          compressed("elastica, hinged, span .3", BeamEnds::kHinged),
          compressed("elastica, clamped, span .3", BeamEnds::kClamped),
          {"roll-up to a circle", testing::roll_up_model, distance_of_tip({0, 0, 0}, 1),
           unit_options()},
          // As given its elements are too long for the masses.
          bend(300, {58.780, 22.245, 40.189}, 1),
          bend(300, {58.780, 22.245, 40.189}, 100),
          bend(600, {47.152, 15.685, 53.472}, 100)};
}

double seconds_of(const ChartedStructure& structure, const ChartedOptions& options, int repeats,
                  ChartedResult& result) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i)
    times.push_back(milliseconds([&] { result = relax_charted(structure, options); }));
  return 1e-3 * median(times);
}

}  // namespace

void run_charted_answers(const SuiteOptions& options, Recorder& recorder) {
  constexpr int kQuickSteps = 100000;
  if (options.quick)
    recorder.note(
        "the paper's chart with 20 and 40 elements, on elasticas and beyond 100000 steps is left "
        "out: --quick");
  for (ChartedAnswer known : charted_answers()) {
    if (options.quick && known.options.motion_until > kQuickSteps) continue;
    if (options.quick) known.options.steps = kQuickSteps;
    for (const int elements : {10, 20, 40}) {
      if (options.quick && elements > 10) continue;
      const ChartedStructure structure(known.model(elements));
      ChartedResult found;
      const double seconds = seconds_of(structure, known.options, 1, found);
      Case result;
      result["case"] = known.name;
      result["method"] = kMethod;
      result["elements"] = elements;
      result["status"] = to_string(found.status);
      result["error"] = known.error(found.unknowns);
      result["steps"] = found.steps;
      result["wall_s"] = seconds;
      recorder.add(result);
    }
  }
}

void run_charted_structure(const std::string& name, BeamModel model, const Eigen::Matrix3Xd& places,
                           const SuiteOptions& options, Recorder& recorder) {
  model.bowing = beams::Bowing::kLeftOut;
  const ChartedStructure charted(model);
  const beams::BeamStructure structure(model);
  const int repeats = options.quick ? 1 : std::min(options.repeats, 3);
  ChartedResult found;
  const double seconds = seconds_of(charted, {}, repeats, found);
  beams::BeamSolveOptions relaxation;
  relaxation.method = beams::BeamMethod::kRelaxation;
  beams::BeamSolution ours;
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i)
    times.push_back(milliseconds([&] { ours = find_equilibrium(structure, relaxation); }));
  const double our_seconds = 1e-3 * median(times);
  const double per_node = 1e6 / structure.nodes();
  Case result;
  result["case"] = name;
  result["method"] = kMethod;
  result["nodes"] = structure.nodes();
  result["status"] = to_string(found.status);
  result["steps"] = found.steps;
  result["us_per_node_step"] = per_node * seconds / found.steps;
  result["relaxation_s"] = seconds;
  result["residual"] = found.residual;
  result["energy"] = charted.elastic_energy(found.unknowns);
  result["rms_from_public"] = std::sqrt((found.unknowns.topRows<3>() - places).squaredNorm() /
                                        static_cast<double>(places.cols()));
  result["our_status"] = to_string(ours.report.status);
  result["our_steps"] = ours.report.relaxation_steps;
  result["our_us_per_node_step"] = per_node * our_seconds / ours.report.relaxation_steps;
  result["our_relaxation_s"] = our_seconds;
  result["our_energy"] = ours.report.elastic_energy;
  result["speedup"] = seconds / our_seconds;
  recorder.add(result);
}

}  // namespace limber::bench
