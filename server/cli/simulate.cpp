#include "server/cli/simulate.h"

#include <fmt/format.h>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/session/simulation.h"
#include "server/cli/local_files.h"
#include "server/cli/progress_bar.h"
#include "server/codec/errors.h"
#include "server/codec/scene_json.h"
#include "server/service/export.h"
#include "server/service/options.h"
#include "server/service/scene_files.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

proto::ExportFormat format_of(const fs::path& output) {
  if (output.extension() == ".pc2") return proto::EXPORT_FORMAT_PC2;
  if (output.extension() == ".pvd" || output.extension() == ".vtu") return proto::EXPORT_FORMAT_PVD;
  throw invalid("output", "a file name ending in .pc2, .pvd or .vtu is expected");
}

/// Before minutes are spent on what could not be written.
void demand_folder(const fs::path& file, const char* field) {
  const fs::path folder = file.parent_path();
  if (!folder.empty() && !fs::is_directory(folder))
    throw Error(ErrorCode::kIo, field, "there is no folder " + folder.string());
}

DecodedScene read_scene(const fs::path& file) {
  proto::Scene message = scene_from_json(scene::read_bytes(file));
  message.clear_base_motion();  // what is simulated now
  DecodedScene decoded = decode_scene(message, "", scene_limits(ServiceLimits{}),
                                      local_loader(file), local_motion_reader(file));
  for (const auto& warning : remarks(message, decoded, ""))
    fmt::print(stderr, "warning: {}: {}\n", warning.field(), warning.message());
  return decoded;
}

session::SimulatedMotion run(const scene::Scene& scene) {
  ProgressBar bar;
  JobContext job;
  job.progress = [&](const std::string& stage, double fraction) { bar.show(stage, fraction); };
  auto motion = session::simulate(scene, job);
  bar.show("done", 1);
  return motion;
}

void write_parts(const std::shared_ptr<const SimulatedScene>& simulated, proto::ExportFormat format,
                 const fs::path& output) {
  for (std::uint32_t part = 0, count = 1; part < count; ++part) {
    const proto::ExportResponse response =
        export_simulation(simulated, format, output.stem().string(), part);
    count = response.part_count();
    for (const auto& file : response.files()) {
      write_file(output.parent_path() / file.name(), file.content(),
                 file.append() ? WriteMode::kAppend : WriteMode::kReplace);
    }
  }
}

void describe(const session::SimulatedMotion& motion) {
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
  const auto format = output.empty() ? proto::EXPORT_FORMAT_UNSPECIFIED : format_of(output);
  if (!scene_output.empty() && scene_output.extension() != ".json")
    throw invalid("scene-out", "a file name ending in .json is expected");
  demand_folder(output, "output");
  demand_folder(scene_output, "scene-out");
  DecodedScene decoded = read_scene(input);
  session::SimulatedMotion motion = run(decoded.scene);
  const auto simulated = std::make_shared<const SimulatedScene>(
      SimulatedScene{std::move(decoded.scene), std::move(motion)});
  if (!output.empty()) {
    write_parts(simulated, format, output);
    const char* ending = format == proto::EXPORT_FORMAT_PC2 ? ".pc2" : ".pvd";
    fmt::print("{}\n", fs::path(output).replace_extension(ending).string());
  }
  if (!scene_output.empty()) {
    write_parts(simulated, proto::EXPORT_FORMAT_SCENE, scene_output);
    fmt::print("{}\n", scene_output.string());
  }
  describe(simulated->motion);
  return 0;
}

}  // namespace limber::server
