#include "server/cli/tools.h"

#include <fmt/format.h>

#include <map>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/samples/samples.h"
#include "server/cli/access.h"
#include "server/cli/backup.h"
#include "server/cli/local_files.h"
#include "server/cli/simulate.h"
#include "server/kinds/beams/job_folder.h"
#include "server/kinds/bodies/export.h"
#include "server/runtime/options.h"
#include "server/transport/curve.h"
#include "server/wire/errors.h"
#include "server/wire/scene_json.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

/// "OUT_OF_RANGE", as clients print it.
std::string short_name(proto::ErrorCode code) {
  constexpr std::size_t kPrefix = std::string_view("ERROR_CODE_").size();
  return proto::ErrorCode_Name(code).substr(kPrefix);
}

void print_error(proto::ErrorCode code, const std::string& field, const std::string& message) {
  fmt::print("error: {}{}{} [{}]\n", field, field.empty() ? "" : ": ", message, short_name(code));
}

std::vector<proto::Issue> issues_of(const fs::path& file, const Kinds& kinds) {
  const proto::Scene scene =
      is_beam_job_folder(file) ? beam_job_scene(file) : scene_from_json(scene::read_bytes(file));
  return kinds.of(scene, "").validate(scene, "", {paths_beside(file), {}});
}

int validate_file(const fs::path& file, const Kinds& kinds) {
  std::vector<proto::Issue> issues;
  try {
    issues = issues_of(file, kinds);
  } catch (const Refusal& fault) {
    // No field if it is no JSON at all: the error is in the file itself.
    print_error(fault.code(), fault.field().empty() ? file.string() : fault.field(), fault.what());
    return 1;
  }
  bool usable = true;
  for (const auto& issue : issues) {
    if (issue.severity() == proto::Issue::SEVERITY_ERROR) {
      usable = false;
      print_error(issue.code(), issue.field(), issue.message());
    } else {
      fmt::print("warning: {}{}{}\n", issue.field(), issue.field().empty() ? "" : ": ",
                 issue.message());
    }
  }
  if (usable) fmt::print("{}: can be opened\n", file.string());
  return usable ? 0 : 1;
}

int write_sample(const std::string& name, const fs::path& folder) {
  const scene::Scene sample = scene::make_sample(name);
  const proto::ExportResponse files = export_scene(sample, name);
  fs::create_directories(folder);
  for (const auto& file : files.files()) {
    write_file(folder / file.name(), file.content());
    fmt::print("{}\n", (folder / file.name()).string());
  }
  return 0;
}

int make_keys(const fs::path& file) {
  const CurveKeys keys = make_curve_keys();
  write_curve_keys(file, keys);
  fmt::print("{}: secret key (keep it)\n{}.pub: public key {}\n", file.string(), file.string(),
             keys.public_key);
  return 0;
}

const std::map<std::string, proto::MaterialVariables> kVariables = {
    {"motion", proto::MATERIAL_VARIABLES_MOTION},
    {"dynamics", proto::MATERIAL_VARIABLES_DYNAMICS},
    {"all", proto::MATERIAL_VARIABLES_ALL}};

}  // namespace

void ToolCommands::add_to(CLI::App& app, const MakeKinds& make_kinds) {
  auto* validate = app.add_subcommand("validate",
                                      "Say what is wrong with a scene file, or a job of the public "
                                      "relaxation code, and where; exit "
                                      "code 1 on errors");
  validate
      ->add_option("scene", input_,
                   "Scene file (.json), a mesh path in it is relative to it; or a job's folder")
      ->required();
  validate->callback([this, make_kinds] {
    chosen_ = [this, make_kinds] { return validate_file(input_, make_kinds({})); };
  });

  auto* sample =
      app.add_subcommand("sample", "Write one of limber's own scenes: DIR/NAME.json and its mesh");
  sample->add_option("name", name_, "Which one")
      ->required()
      ->check(CLI::IsMember(scene::sample_names()));
  sample->add_option("dir", output_, "Folder, made if missing")->required();
  sample->callback([this] { chosen_ = [this] { return write_sample(name_, output_); }; });

  add_tetrahedralize(app);

  auto* simulate = app.add_subcommand(
      "simulate", "The motion that a scene's `simulation` describes, as files (.pc2, .pvd)");
  simulate->add_option("scene", input_, "Scene file (.json)")->required();
  simulate->add_option(
      "-o,--output", output_,
      "FILE.pc2 (with the surface as FILE.obj), or FILE.pvd (with a .vtu per frame)");
  simulate->add_option("--scene-out", scene_output_,
                       "FILE.json: the scene with this motion as its base motion; both beside it");
  simulate->callback(
      [this] { chosen_ = [this] { return simulate_file(input_, output_, scene_output_); }; });

  add_recover(app);

  add_backup_command(app, chosen_);
  add_access_commands(app, chosen_);

  auto* keygen = app.add_subcommand("keygen", "Make a CURVE key pair: FILE (secret) and FILE.pub");
  keygen->add_option("file", output_, "File of the secret key; must not exist")->required();
  keygen->callback([this] { chosen_ = [this] { return make_keys(output_); }; });
}

void ToolCommands::add_tetrahedralize(CLI::App& app) {
  auto& line = tetrahedralize_;
  auto* command = app.add_subcommand(
      "tetrahedralize",
      "A closed triangle surface (.obj, .ply, .stl, .off, .glb) to a tet mesh (.msh, .vtu)");
  command->add_option("surface", line.surface, "Surface file")->required();
  command->add_option("-o,--output,output", line.output, "Mesh file to write (.msh, .vtu)")
      ->required();
  command
      ->add_option("--tets", line.options.target_tets, "Wanted number of tets, met within a tenth")
      ->capture_default_str();
  command
      ->add_option("--within", line.options.within,
                   "Largest distance between the surface and that of the tets, as a share of the "
                   "body's length; 1 allows any")
      ->capture_default_str();
  command->add_flag("--json", line.json, "The report as JSON");
  command->callback([this] { chosen_ = [this] { return tetrahedralize_file(tetrahedralize_); }; });
}

void ToolCommands::add_recover(CLI::App& app) {
  auto* recover = app.add_subcommand(
      "recover", "The material of a scene's base motion, and how the motion continues with it");
  auto& request = recovery_.request;
  const auto number = [&](const char* name, auto set, const char* text) {
    recover->add_option_function<std::uint32_t>(
        name, [set](const std::uint32_t& value) { set(value); }, text);
  };
  const auto real = [&](const char* name, auto set, const char* text) {
    recover->add_option_function<double>(
        name, [set](const double& value) { set(value); }, text);
  };
  recover->add_option("scene", recovery_.scene, "Scene file (.json)")->required();
  recover->add_option(
      "-o,--output", recovery_.output,
      "FILE.pc2 (with the surface as FILE.obj), or FILE.pvd (with a .vtu per frame)");
  number(
      "--frames", [&](auto n) { request.set_recovered_frames(n); }, "Frames to recover from");
  number(
      "--driven", [&](auto n) { request.set_driven_frames(n); },
      "The first frames, in which forces are known to act");
  number(
      "--total", [&](auto n) { request.set_total_frames(n); }, "Frames of the continued motion");
  real(
      "--weight", [&](double gamma) { request.set_weight(gamma); }, "gamma of the poses");
  real(
      "--column-weight", [&](double mu) { request.set_column_weight(mu); }, "mu of mixed modes");
  recover->add_option("--modes", recovery_.modes, "In place of model.modes");
  recover->add_option("--candidate-modes", recovery_.candidate_modes,
                      "In place of model.candidate_modes");
  recover
      ->add_option_function<std::string>(
          "--variables",
          [&](const std::string& name) { request.set_variables(kVariables.at(name)); },
          "What is recovered")
      ->check(CLI::IsMember({"motion", "dynamics", "all"}));
  recover
      ->add_option_function<std::string>(
          "--start",
          [&](const std::string& name) {
            request.set_start(name == "spectrum" ? proto::RECOVERY_START_SPECTRUM
                                                 : proto::RECOVERY_START_PRINCIPAL_COMPONENTS);
          },
          "Where it begins")
      ->check(CLI::IsMember({"principal", "spectrum"}));
  recover->add_flag("--json", recovery_.json, "The report as JSON");
  recover->callback([this] { chosen_ = [this] { return recover_file(recovery_); }; });
}

std::optional<int> ToolCommands::run() const {
  if (!chosen_) return std::nullopt;
  return chosen_();
}

}  // namespace limber::server
