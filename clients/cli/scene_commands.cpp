// sample, validate, tetrahedralize, simulate, recover: scenes before they are sessions.

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "clients/cli/limberd.h"
#include "clients/cpp/scene_files.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

using client::ClientError;

/// The command line is well formed: a file that is not there is refused as `open` refuses it.
void demand_readable(const std::string& path, const char* field) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored) || access(path.c_str(), R_OK) != 0)
    throw ClientError(v1::ERROR_CODE_IO, field, "cannot read " + path);
}

void sample(Context& context, const std::string& name, const std::string& out) {
  const auto response = client::sample(context.client(), name);
  if (name.empty()) {
    if (context.json) return print_json(response);
    for (const auto& known : response.names()) fmt::print("{}\n", known);
    return;
  }
  if (out.empty()) return print_json(response.scene());
  const auto path = client::save_scene(response.scene(), name, out);
  fmt::print("{}\n",
             context.json ? fmt::format(R"({{"file": "{}"}})", path.string()) : path.string());
}

struct RecoverArguments {
  std::string scene, output;
  std::vector<std::string> given;  // other options and their values, as limberd takes them
};

void recover_command(CLI::App& app, Context& context) {
  auto line = std::make_shared<RecoverArguments>();
  auto* command = subcommand(
      app, "recover",
      "Recover the material of a scene's base motion: frequencies, damping, modes; and continue "
      "the motion with it (needs no server)",
      "limber recover scene.json --frames 150 --driven 30 --modes 10 -o continued.pc2");
  const auto pass = [&](const char* name, const char* text) {
    return command->add_option_function<std::string>(
        name,
        [line, name](const std::string& value) {
          line->given.insert(line->given.end(), {name, value});
        },
        text);
  };
  const auto whole = CLI::TypeValidator<std::uint32_t>("UINT");
  command->add_option("scene", line->scene, "Scene file with a base_motion")->required();
  pass("--frames", "Recover from the first so many frames (default: the first half)")->check(whole);
  pass("--driven", "In the first so many of them forces are known to act: they do not count there")
      ->check(whole);
  pass("--modes", "Modes that the material gets (default: the scene's)")->check(whole);
  pass("--candidate-modes", "Modes that they are mixed of (default: the scene's, else 80)")
      ->check(whole);
  pass("--variables",
       "motion: forces only; dynamics: frequencies and damping; all: and the modes (default)")
      ->check(CLI::IsMember({"motion", "dynamics", "all"}));
  pass("--start", "principal: principal components of the motion (default); spectrum: its FFT")
      ->check(CLI::IsMember({"principal", "spectrum"}));
  pass("--weight", "gamma: how closely poses are followed (default 1)")->check(CLI::Number);
  pass("--column-weight", "mu: how near mixed modes stay to unit size (default 1e-8)")
      ->check(CLI::Number);
  pass("--total", "Frames of the continued motion (default: those of the base motion)")
      ->check(whole);
  command->add_option("-o,--out", line->output,
                      "FILE.pc2 (with the surface as FILE.obj), or FILE.pvd or FILE.vtu");
  command->callback([line, &context] {
    demand_readable(line->scene, "scene");
    std::vector<std::string> arguments = {"recover", line->scene};
    if (!line->output.empty()) arguments.insert(arguments.end(), {"--output", line->output});
    arguments.insert(arguments.end(), line->given.begin(), line->given.end());
    if (context.json) arguments.emplace_back("--json");
    become_limberd(arguments);
  });
}

}  // namespace

void add_scene_commands(CLI::App& app, Context& context) {
  auto name = std::make_shared<std::string>();
  auto out = std::make_shared<std::string>();
  auto* command =
      subcommand(app, "sample", "Write a sample scene as a file; without a name, list the samples",
                 "limber sample flower --out scenes");
  command->add_option("name", *name,
                      "beam, flower, bird, dino, grid, hyperboloid, dome, arch or gridshell");
  command->add_option("-o,--out", *out, "Folder for NAME.json (default: print it)");
  command->callback([&context, name, out] { sample(context, *name, *out); });

  auto scene = std::make_shared<std::string>();
  command = subcommand(app, "validate",
                       "Say what is wrong with a scene file, and where, as text (needs no server)",
                       "limber validate scene.json");
  command->add_option("scene", *scene, "Scene file, or folder of a public job of beams")
      ->required();
  command->callback([scene] {
    demand_readable(client::file_of_scene(*scene).string(), "scene");
    become_limberd({"validate", *scene});
  });

  auto surface = std::make_shared<std::string>();
  auto mesh = std::make_shared<std::string>("out.msh");
  auto tets = std::make_shared<unsigned>(5000);
  command = subcommand(app, "tetrahedralize",
                       "Fill a closed triangle surface with tets (needs no server)",
                       "limber tetrahedralize bunny.obj -o bunny.msh --tets 8000 --within 0.01");
  command->add_option("surface", *surface, ".obj, .ply, .stl, .off or .glb")->required();
  command->add_option("-o,--out", *mesh, "Mesh file to write")->capture_default_str();
  command->add_option("--tets", *tets, "About how many tets")
      ->check(CLI::Range(50U, 5000000U))
      ->capture_default_str();
  auto within = std::make_shared<double>(0.02);
  command
      ->add_option(
          "--within", *within,
          "Largest distance between the surface and that of the tets, in either direction, as a "
          "share of the body's length (diagonal of its bounding box): fails, and says how "
          "many tets would do, where it is not kept. 1 allows any")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->callback([surface, mesh, tets, within, &context] {
    demand_readable(*surface, "surface");
    std::vector<std::string> arguments = {
        "tetrahedralize",          *surface, *mesh, "--tets", std::to_string(*tets), "--within",
        fmt::format("{}", *within)};
    if (context.json) arguments.emplace_back("--json");
    become_limberd(arguments);
  });

  auto motion = std::make_shared<std::string>();
  auto edited = std::make_shared<std::string>();
  command = subcommand(
      app, "simulate",
      "Compute the motion that a scene's `simulation` describes: loads, initial state (needs no "
      "server)",
      "limber simulate scene.json -o motion.pc2 --scene-out edited.json && limber open "
      "edited.json");
  command->add_option("scene", *scene, "Scene file")->required();
  command->add_option(
      "-o,--out", *motion,
      "FILE.pc2 (with the surface as FILE.obj), or FILE.pvd or FILE.vtu (a .vtu for "
      "every frame and a .pvd)");
  command->add_option("--scene-out", *edited,
                      "FILE.json: the scene with the motion as its base motion, to edit; mesh and "
                      "motion go beside it");
  command->callback([scene, motion, edited] {
    if (motion->empty() && edited->empty()) throw CLI::RequiredError("--out or --scene-out");
    demand_readable(*scene, "scene");
    std::vector<std::string> arguments = {"simulate", *scene};
    if (!motion->empty()) arguments.insert(arguments.end(), {"--output", *motion});
    if (!edited->empty()) arguments.insert(arguments.end(), {"--scene-out", *edited});
    become_limberd(arguments);
  });

  recover_command(app, context);
}

}  // namespace limber::cli
