// sample, validate, tetrahedralize, simulate, recover, open: scenes before they are sessions.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "clients/cli/context.h"
#include "clients/cli/material_variables.h"
#include "clients/cli/print.h"
#include "clients/cpp/beam_files.h"
#include "clients/cpp/plain_files.h"
#include "clients/cpp/scene_files.h"

namespace limber::cli {
namespace {

using client::ClientError;
using client::Milliseconds;

/// Becomes limberd with these arguments, under the name of limber: validation, tetrahedralisation,
/// simulation and recovery need the engine, which clients do not link.
void become_limberd(std::vector<std::string> arguments) {
  const std::string limberd = find_limberd();
  arguments.insert(arguments.begin(), "limber");
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::fflush(nullptr);
  execv(limberd.c_str(), argv.data());
  throw ClientError(v1::ERROR_CODE_NOT_FOUND, "limberd", fmt::format("cannot run {}", limberd));
}

/// The command line is well formed: a file that is not there is refused as `open` refuses it.
void demand_readable(const std::string& path, const char* field) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored) || access(path.c_str(), R_OK) != 0)
    throw ClientError(v1::ERROR_CODE_IO, field, "cannot read " + path);
}

void sample(Context& context, const std::string& name, const std::string& out) {
  v1::GetSampleRequest request;
  request.set_name(name);
  const auto response = context.client().call(request, Milliseconds{60000});
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

struct OpenOptions {
  std::string scene, sample, session, optimise;
  std::optional<double> max_frequency_hz;
  std::optional<std::uint32_t> slow_steps;
  std::optional<std::uint32_t> tets;  // that fill a surface, with the next
  std::optional<double> within;
  bool no_wait = false;
  double wait_s = 600;
};

/// Waits for a job and shows how far it is. @throws ClientError what the job failed with
void follow(Context& context, std::uint64_t job, double wait_s) {
  ProgressBar bar;
  const auto deadline = std::chrono::steady_clock::now() + milliseconds(wait_s);
  while (true) {
    v1::GetJobRequest request;
    request.set_job(job);
    request.set_wait_s(0.2);
    const auto status = context.client().call(request).status();
    const std::string stage =
        status.progress().stage().empty() ? "waiting" : status.progress().stage();
    if (status.state() == v1::JOB_STATE_DONE) return bar.show(stage, 1);
    if (status.state() == v1::JOB_STATE_FAILED || status.state() == v1::JOB_STATE_CANCELLED) {
      if (status.has_error()) throw ClientError(status.error());
      throw ClientError(v1::ERROR_CODE_CANCELLED, "",
                        fmt::format("job {} ended without a result", job));
    }
    bar.show(stage, status.progress().fraction());
    if (std::chrono::steady_clock::now() > deadline)
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "",
                        fmt::format("job {} still runs after {} s", job, wait_s));
  }
}

/// After Ctrl-C: the session that was being opened is closed, over a connection that ignores the
/// interrupt.
void close_quietly(const Context& context, const std::string& session) {
  auto options = context.client_options();
  options.interrupted = nullptr;
  options.timeout = Milliseconds{5000};
  try {
    client::Client client(context.endpoint, options);
    v1::CloseSessionRequest request;
    request.set_session(session);
    (void)client.call(request);
    fmt::print(stderr, "limber: cancelled, session {} is closed\n", session);
  } catch (const ClientError& error) {
    fmt::print(stderr, "limber: session {} could not be closed: {}\n", session, error.what());
  }
}

/// Of the server.
std::vector<std::string> sample_names(Context& context) {
  const auto known = context.client().call(v1::GetSampleRequest{}, Milliseconds{60000});
  return {known.names().begin(), known.names().end()};
}

/// No file is there, but the server has a sample of this name.
/// @throws ClientError naming the samples where there is neither
bool is_sample(Context& context, const std::string& scene) {
  std::error_code ignored;
  if (std::filesystem::exists(scene, ignored)) return false;
  const std::vector<std::string> names = sample_names(context);
  if (std::find(names.begin(), names.end(), scene) != names.end()) return true;
  throw ClientError(v1::ERROR_CODE_IO, "scene",
                    fmt::format("cannot read {}: there is no such file, and the samples are {}",
                                scene, fmt::join(names, ", ")));
}

/// A .ply of lines beside the file of its job is no surface.
ClientError with_hint_at_job(const ClientError& error, const std::filesystem::path& file) {
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  std::error_code ignored;
  if (!std::filesystem::exists(folder / "SimulationJob.json", ignored)) return error;
  return {error.code(), error.field(),
          fmt::format("{}; {} is a job of the public relaxation code: open the folder",
                      error.what(), folder.string()),
          error.details()};
}

v1::MeshArrays tets_within(Context& context, const OpenOptions& options) {
  v1::TetrahedralizeRequest request;
  *request.mutable_surface() = client::mesh_file(options.scene, "scene");
  if (options.tets) request.set_target_tets(*options.tets);
  if (options.within) request.set_within(*options.within);
  const std::uint64_t job = context.client().call(request, Milliseconds{60000}).job();
  try {
    follow(context, job, options.wait_s);
  } catch (const ClientError&) {
    if (interrupted()) {
      v1::CancelRequest cancel;
      cancel.set_job(job);
      (void)context.client().call(cancel);
    }
    throw;
  }
  v1::GetJobRequest wanted;
  wanted.set_job(job);
  v1::GetJobResponse done = context.client().call(wanted, Milliseconds{60000});
  return std::move(*done.mutable_mesh());
}

/// The tets that fill a surface, as a scene with the server's defaults.
v1::Scene filled(Context& context, const OpenOptions& options) {
  v1::Scene scene;
  scene.set_name(std::filesystem::path(options.scene).stem().string());
  scene.set_frames(client::kFramesOfPlainFiles);
  try {
    *scene.mutable_mesh()->mutable_arrays() = tets_within(context, options);
  } catch (const client::Unreachable&) {
    throw;
  } catch (const ClientError& error) {
    if (error.code() != v1::ERROR_CODE_INVALID_ARGUMENT) throw;
    throw with_hint_at_job(error, options.scene);
  }
  return scene;
}

/// @throws ClientError of a file that is no scene
v1::Scene scene_of(Context& context, const OpenOptions& options, client::FileKind kind) {
  switch (kind) {
    case client::FileKind::kTets:
      return client::scene_of_tets(options.scene);
    case client::FileKind::kTriangles:
      return filled(context, options);
    case client::FileKind::kLines:
      return client::scene_of_lines(options.scene);
    case client::FileKind::kScene:
      break;
  }
  return client::load_scene(options.scene);
}

/// What was chosen for a file that is no scene.
void tell_assumed(Context& context, const std::string& path, const std::string& session) {
  v1::GetSessionRequest request;
  request.set_session(session);
  request.set_with_scene(true);
  fmt::print(stderr,
             "note: {} is opened as {}. To change that: limber export {} --format scene, edit the "
             "file, open it\n",
             path, client::assumed(context.client().call(request).scene()), session);
}

/// What `open` is short of, as far as a server can be asked.
std::string what_to_open(Context& context) {
  try {
    return fmt::format("a scene file, or a sample: {}", fmt::join(sample_names(context), ", "));
  } catch (const ClientError&) {
    return "a scene file or --sample (`limber sample` lists them)";
  }
}

/// @throws ClientError of options of filling for what is no surface
void refuse_filling(const OpenOptions& options, client::FileKind kind) {
  if (kind == client::FileKind::kTriangles || (!options.tets && !options.within)) return;
  throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, options.tets ? "tets" : "within",
                    "--tets and --within are for a closed surface (.obj, .ply, .stl) that is to "
                    "be filled");
}

void open(Context& context, const OpenOptions& options) {
  v1::OpenSessionRequest request;
  request.set_session(options.session);
  const bool named = options.sample.empty() && is_sample(context, options.scene);
  client::FileKind kind = client::FileKind::kScene;
  if (options.sample.empty() && !named) {
    kind = client::kind_of_file(options.scene);
    refuse_filling(options, kind);
    *request.mutable_scene() = scene_of(context, options, kind);
  } else {
    refuse_filling(options, client::FileKind::kScene);
    v1::GetSampleRequest wanted;
    wanted.set_name(named ? options.scene : options.sample);
    *request.mutable_scene() = context.client().call(wanted, Milliseconds{60000}).scene();
  }
  auto& scene = *request.mutable_scene();
  if (!options.optimise.empty()) {
    scene.mutable_material_optimisation()->set_variables(kMaterialVariables.at(options.optimise));
  }
  if (options.max_frequency_hz)
    scene.mutable_material_optimisation()->set_max_frequency_hz(*options.max_frequency_hz);
  if (options.slow_steps)
    scene.mutable_material_optimisation()->set_slow_steps(*options.slow_steps);
  v1::OpenSessionResponse opened;
  {
    const DeferInterrupts defer;  // what has been opened must be known, to be closed again
    opened = context.client().call(request, Milliseconds{60000});
  }
  for (const auto& issue : opened.issues()) fmt::print(stderr, "{}\n", describe(issue));
  if (kind != client::FileKind::kScene) tell_assumed(context, options.scene, opened.session());
  if (!options.no_wait) {
    try {
      follow(context, opened.job(), options.wait_s);
    } catch (const ClientError&) {
      if (interrupted()) close_quietly(context, opened.session());
      throw;
    }
  }
  v1::GetSessionRequest status_request;
  status_request.set_session(opened.session());
  const auto status = context.client().call(status_request).status();
  if (status.has_result()) note_failure(context, status.result());
  if (status.has_model() && !status.model().met_tolerance())
    fmt::print(stderr, "warning: the model misses its tolerance: {}\n", status.model().message());
  if (context.json) return print_json(status);
  fmt::print("session {}: {}, {}\n", title(status), sizes(status), state_words(status));
  if (!status.has_model()) return;
  fmt::print("model: {}, {:.2f} s{}\n", describe(status.model()), status.model().build_s(),
             status.model().from_cache() ? ", from the cache" : "");
  if (status.model().met_tolerance() && !status.model().message().empty())
    fmt::print("note: {}\n", status.model().message());
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
    demand_readable(client::is_beam_job(*scene) && std::filesystem::is_directory(*scene)
                        ? *scene + "/SimulationJob.json"
                        : *scene,
                    "scene");
    become_limberd({"validate", *scene});
  });

  auto surface = std::make_shared<std::string>();
  auto mesh = std::make_shared<std::string>("out.msh");
  auto tets = std::make_shared<unsigned>(5000);
  command = subcommand(app, "tetrahedralize",
                       "Fill a closed triangle surface with tets (needs no server)",
                       "limber tetrahedralize bunny.obj -o bunny.msh --tets 8000 --within 0.01");
  command->add_option("surface", *surface, ".obj, .ply or .stl")->required();
  command->add_option("-o,--out", *mesh, "Mesh file to write")->capture_default_str();
  command->add_option("--tets", *tets, "About how many tets")
      ->check(CLI::Range(50U, 5000000U))
      ->capture_default_str();
  auto within = std::make_shared<double>(0.02);
  command
      ->add_option("--within", *within,
                   "Largest distance between the surface and that of the tets, either way, as a "
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

  auto options = std::make_shared<OpenOptions>();
  command =
      subcommand(app, "open", "Open a scene as a session: upload it, build its model, solve it",
                 "limber open scene.json --session robot\n  limber open mesh.msh\n  limber open "
                 "--sample flower --optimise all");
  auto* file =
      command->add_option("scene", options->scene,
                          "Scene file (JSON), whose mesh file is uploaded; a job of the public "
                          "relaxation code (its folder); the name of a sample; or, with defaults "
                          "that are told, a mesh of tets (.msh, .vtk, .vtu, .mesh, .ele, .veg, "
                          ".abq), a closed surface to be filled with tets (.obj, .ply, .stl), or "
                          "lines of a linkage (.obj with `l`)");
  auto* known = command
                    ->add_option("--sample", options->sample,
                                 "A sample scene instead; `limber sample` lists them")
                    ->excludes(file);
  command->add_option("--session", options->session,
                      "Name for the session (default: the server chooses)");
  command
      ->add_option("--optimise,--optimize", options->optimise,
                   "In place of what the scene says: motion (control forces), dynamics (and "
                   "frequencies and damping), all (and the modes, mixed from 80)")
      ->check(CLI::IsMember({"motion", "dynamics", "all"}));
  command->add_option("--max-frequency", options->max_frequency_hz,
                      "Highest frequency of a fitted mode [Hz], at most half the frames per second "
                      "(default: an eighth of the frames per second)");
  command->add_option("--slow-steps", options->slow_steps,
                      "Steps at the beginning of a fit that keep frequencies below 1/24 of the "
                      "frames per second and those of the scene, at most 1000 (default: 10)");
  command->add_option("--tets", options->tets, "Of a surface: about so many tets (default: 5000)");
  command->add_option("--within", options->within,
                      "Of a surface: keep within this share of the body's length (default: 0.02)");
  command->add_flag("--no-wait", options->no_wait, "Return while the model is still being built");
  command->add_option("--wait", options->wait_s, "Seconds to wait for it")
      ->check(seconds_in(0.1, 1e6))
      ->capture_default_str();
  command->callback([&context, options, file, known] {
    if (file->count() + known->count() != 1) throw CLI::RequiredError(what_to_open(context));
    open(context, *options);
  });
}

}  // namespace limber::cli
