#include "server/cli/simulate.h"

#include <fmt/format.h>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/session/bodies/simulation.h"
#include "server/cli/local_files.h"
#include "server/cli/motion_files.h"
#include "server/cli/progress_bar.h"
#include "server/kinds/bodies/export.h"
#include "server/kinds/bodies/limits.h"
#include "server/kinds/bodies/scene_readers.h"
#include "server/kinds/bodies/scenes.h"
#include "server/runtime/options.h"
#include "server/wire/errors.h"
#include "server/wire/scene_json.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

/// For the scene that is written, in which the motion is edited on.
void keep_constraints(proto::Scene message, const fs::path& file, scene::Scene& simulated) {
  message.clear_base_motion();
  try {
    DecodedScene whole =
        decode_scene(message, "", scene_limits(ServiceLimits{}), scene_readers(paths_beside(file)));
    (void)remarks(message, whole, "");
    simulated.constraints = std::move(whole.scene.constraints);
    simulated.keyframes = std::move(whole.scene.keyframes);
  } catch (const std::exception& fault) {
    fmt::print(stderr, "warning: the written scene has no constraints and no keyframes: {}\n",
               fault.what());
  }
}

DecodedScene read_simulated_scene(const fs::path& file, const fs::path& scene_output) {
  const proto::Scene given = scene_from_json(scene::read_bytes(file));
  demand_body(given, "");
  proto::Scene message = given;
  leave_simulation(message);
  DecodedScene decoded =
      decode_scene(message, "", scene_limits(ServiceLimits{}), scene_readers(paths_beside(file)));
  if (!scene_output.empty() && given.constraints_size() + given.keyframes_size() > 0)
    keep_constraints(given, file, decoded.scene);
  for (const auto& warning : remarks(message, decoded, ""))
    fmt::print(stderr, "warning: {}: {}\n", warning.field(), warning.message());
  return decoded;
}

session::SimulatedMotion simulate_scene(const scene::Scene& scene) {
  ProgressBar bar;
  JobContext job;
  job.progress = [&](const std::string& stage, double fraction) { bar.show(stage, fraction); };
  auto motion = session::simulate(scene, job);
  bar.show("done", 1);
  return motion;
}

void print_motion(const session::SimulatedMotion& motion) {
  const session::SimulationReport& report = motion.report;
  fmt::print("{} frames, {} nodes; {} steps ({} halved), {} of Newton's method\n",
             motion.positions.cols(), motion.positions.rows() / 3, report.steps,
             report.shortened_steps, report.newton_steps);
  fmt::print(
      "energy: {:.3g} J at most, drift {:.2g} of it; smallest volume {:.2g} of that at rest\n",
      (report.kinetic + report.elastic).maxCoeff(), report.energy_drift,
      report.smallest_volume_ratio);
  if (!report.message.empty()) fmt::print(stderr, "warning: {}\n", report.message);
}

}  // namespace

int simulate_file(const fs::path& input, const fs::path& output, const fs::path& scene_output) {
  if (output.empty() && scene_output.empty())
    throw invalid("output", "--output or --scene-out is expected");
  const auto format = output.empty() ? proto::EXPORT_FORMAT_UNSPECIFIED : motion_format(output);
  if (!scene_output.empty() && scene_output.extension() != ".json")
    throw invalid("scene-out", "a file name ending in .json is expected");
  demand_folder(output, "output");
  demand_folder(scene_output, "scene-out");
  DecodedScene decoded = read_simulated_scene(input, scene_output);
  session::SimulatedMotion simulated = simulate_scene(decoded.scene);
  const auto motion = std::make_shared<const ComputedMotion>(
      ComputedMotion{std::move(decoded.scene), std::move(simulated.geometry), simulated.positions,
                     simulated.report.frames_per_second});
  if (!output.empty()) {
    write_motion(motion, format, output);
    const char* ending = format == proto::EXPORT_FORMAT_PC2 ? ".pc2" : ".pvd";
    fmt::print("{}\n", fs::path(output).replace_extension(ending).string());
  }
  if (!scene_output.empty()) {
    write_motion(motion, proto::EXPORT_FORMAT_SCENE, scene_output);
    fmt::print("{}\n", scene_output.string());
  }
  print_motion(simulated);
  return 0;
}

}  // namespace limber::server
