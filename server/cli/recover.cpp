#include "server/cli/recover.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/session/bodies/recovery.h"
#include "server/cli/local_files.h"
#include "server/cli/motion_files.h"
#include "server/cli/print_json.h"
#include "server/cli/progress_bar.h"
#include "server/kinds/bodies/export.h"
#include "server/kinds/bodies/limits.h"
#include "server/kinds/bodies/recovery.h"
#include "server/kinds/bodies/scene_readers.h"
#include "server/kinds/bodies/scenes.h"
#include "server/runtime/options.h"
#include "server/wire/errors.h"
#include "server/wire/scene_json.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

DecodedScene read_scene(const RecoverOptions& options) {
  proto::Scene message = scene_from_json(scene::read_bytes(options.scene));
  demand_body(message, "");
  if (message.base_motion().source_case() == proto::BaseMotion::SOURCE_NOT_SET)
    throw invalid("base_motion", "the scene has no base motion to recover a material from");
  message.clear_constraints();
  message.clear_keyframes();
  if (options.modes) message.mutable_model()->set_modes(static_cast<std::uint32_t>(*options.modes));
  if (options.candidate_modes) {
    message.mutable_model()->set_candidate_modes(
        static_cast<std::uint32_t>(*options.candidate_modes));
  }
  DecodedScene decoded = decode_scene(message, "", scene_limits(ServiceLimits{}),
                                      scene_readers(paths_beside(options.scene)));
  for (const auto& warning : remarks(message, decoded, ""))
    fmt::print(stderr, "warning: {}: {}\n", warning.field(), warning.message());
  return decoded;
}

session::MaterialRecovery recover_material(const scene::Scene& scene,
                                           const session::RecoveryRequest& recovery_request) {
  ProgressBar bar;
  JobContext job;
  job.progress = [&](const std::string& stage, double fraction) { bar.show(stage, fraction); };
  auto recovery = session::recover(scene, recovery_request, job);
  bar.show("done", 1);
  return recovery;
}

void print_table(const proto::RecoveryReport& report) {
  fmt::print("{:>4}  {:>14}  {:>13}  {:>11}\n", "mode", "frequency [Hz]", "damping ratio",
             "decay [1/s]");
  for (int k = 0; k < report.modes_size(); ++k) {
    const auto& mode = report.modes(k);
    fmt::print("{:>4}  {:>14.4g}  {:>13.3g}  {:>11.3g}\n", k + 1, mode.frequency_hz(),
               mode.damping_ratio(), mode.decay_per_s());
  }
  fmt::print("{} after {} steps; forces {:.3g}, poses missed by {:.3g}\n",
             report.converged() ? "converged" : "not converged", report.steps(),
             report.force_energy(), report.constraint_energy());
  fmt::print("off by {:.2g} % in the {} frames recovered from; the modes see all but {:.2g} %\n",
             100 * report.recovered_error(), report.recovered_frames(),
             100 * report.projection_error());
  if (report.frames() > report.recovered_frames()) {
    fmt::print("continued to {} frames: off by {:.2g} %, the last by {:.2g} %\n", report.frames(),
               100 * report.continued_error(), 100 * report.final_frame_error());
  }
}

}  // namespace

int recover_file(const RecoverOptions& options) {
  const auto format =
      options.output.empty() ? proto::EXPORT_FORMAT_UNSPECIFIED : motion_format(options.output);
  demand_folder(options.output, "output");
  DecodedScene decoded = read_scene(options);
  const std::uint32_t most = ServiceLimits{}.frames;
  if (options.request.total_frames() > most)
    throw limit_exceeded("total_frames", "frames", most, options.request.total_frames());
  const session::RecoveryRequest recovery_request =
      decode_recovery(options.request).resolved(decoded.scene.frame_count);
  session::MaterialRecovery recovery = recover_material(decoded.scene, recovery_request);
  const proto::RecoveryReport report = encode_report(recovery);
  if (!options.output.empty()) {
    const auto motion = std::make_shared<const ComputedMotion>(
        ComputedMotion{std::move(decoded.scene), std::move(recovery.geometry),
                       std::move(recovery.positions), report.frames_per_second()});
    write_motion(motion, format, options.output);
  }
  if (options.json) {
    print_json(report);
    return 0;
  }
  if (!options.output.empty()) {
    const char* ending = format == proto::EXPORT_FORMAT_PC2 ? ".pc2" : ".pvd";
    fmt::print("{}\n", fs::path(options.output).replace_extension(ending).string());
  }
  print_table(report);
  if (!report.message().empty()) fmt::print(stderr, "note: {}\n", report.message());
  return 0;
}

}  // namespace limber::server
