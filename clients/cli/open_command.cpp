// open: scenes, samples, and files of a shape alone, as sessions.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/cli/bodies/fill_surface.h"
#include "clients/cli/bodies/material_variables.h"
#include "clients/cli/context.h"
#include "clients/cli/jobs.h"
#include "clients/cli/kinds.h"
#include "clients/cli/print.h"
#include "clients/cpp/bodies/plain_files.h"
#include "clients/cpp/bodies/scene_files.h"
#include "clients/cpp/linkages/plain_files.h"
#include "clients/cpp/open_session.h"
#include "clients/cpp/opening.h"
#include "clients/cpp/plain_files.h"
#include "clients/cpp/scene_files.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

using client::ClientError;

struct OpenOptions {
  std::string scene, sample, session, optimise;
  std::optional<double> max_frequency_hz;
  std::optional<std::uint32_t> slow_steps;
  bodies::Filling filling;  // of a surface
  std::string stiffness;    // a file, for a body
  v1::PaintedPoints painted_points = v1::PAINTED_POINTS_UNSPECIFIED;
  v1::PaintedQuantity painted_quantity = v1::PAINTED_QUANTITY_UNSPECIFIED;
  bool no_wait = false;
  double wait_s = 600;
};

/// After Ctrl-C: the session that was being opened is closed, over a connection that ignores the
/// interrupt.
void close_quietly(const Context& context, const std::string& session) {
  try {
    const client::ClientOptions options = context.closing_options();
    client::Client client(context.endpoint, options);
    client::OpenSession(client, session, client::Naming::kAsGiven).close(options.timeout);
    fmt::print(stderr, "limber: cancelled, session {} is closed\n", session);
  } catch (const ClientError& error) {
    fmt::print(stderr, "limber: session {} could not be closed: {}\n", session, error.what());
  }
}

/// Names of the server's samples.
std::vector<std::string> sample_names(Context& context) {
  const auto known = client::sample(context.client());
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

/// @throws ClientError of a file that is no scene
v1::Scene scene_of(Context& context, const OpenOptions& options, client::FileKind kind) {
  switch (kind) {
    case client::FileKind::kTets:
      return client::scene_of_tets(options.scene);
    case client::FileKind::kTriangles:
      return bodies::fill_surface(context, options.scene, options.filling, options.wait_s);
    case client::FileKind::kLines:
      return client::scene_of_lines(options.scene);
    case client::FileKind::kScene:
      break;
  }
  return client::load_scene(options.scene);
}

/// Choices that were made for a file that is no scene.
void print_assumptions(Context& context, const std::string& path, const std::string& session) {
  const auto response = context.session<client::OpenSession>(session).status_and_scene();
  fmt::print(stderr,
             "note: {} is opened as {}. To change that: limber export {} --format scene, edit the "
             "file, open it\n",
             path, kind_of(response.status()).assumptions(response.scene()), session);
}

/// Missing arguments of `open`, as far as a server can be asked.
std::string what_to_open(Context& context) {
  try {
    return fmt::format("a scene file, or a sample: {}", fmt::join(sample_names(context), ", "));
  } catch (const ClientError&) {
    return "a scene file or --sample (`limber sample` lists them)";
  }
}

/// @throws ClientError for options of filling if the file is no surface
void refuse_filling(const OpenOptions& options, client::FileKind kind) {
  if (kind == client::FileKind::kTriangles || !options.filling.is_given()) return;
  throw ClientError(
      v1::ERROR_CODE_INVALID_ARGUMENT, options.filling.tets ? "tets" : "within",
      "--tets and --within are for a closed surface (.obj, .ply, .stl, .off, .glb) that is to "
      "be filled");
}

void open(Context& context, const OpenOptions& options) {
  v1::Scene scene;
  const bool named = options.sample.empty() && is_sample(context, options.scene);
  client::FileKind kind = client::FileKind::kScene;
  if (options.sample.empty() && !named) {
    kind = client::kind_of_file(options.scene);
    refuse_filling(options, kind);
    scene = scene_of(context, options, kind);
  } else {
    refuse_filling(options, client::FileKind::kScene);
    scene = client::sample(context.client(), named ? options.scene : options.sample).scene();
  }
  if (!options.optimise.empty()) {
    scene.mutable_material_optimisation()->set_variables(
        bodies::kMaterialVariables.at(options.optimise));
  }
  if (!options.stiffness.empty()) {
    auto& painted = *scene.mutable_painted_stiffness();
    painted = client::painted_stiffness(options.stiffness, "stiffness");
    painted.set_points(options.painted_points);
    painted.set_quantity(options.painted_quantity);
  }
  if (options.max_frequency_hz)
    scene.mutable_material_optimisation()->set_max_frequency_hz(*options.max_frequency_hz);
  if (options.slow_steps)
    scene.mutable_material_optimisation()->set_slow_steps(*options.slow_steps);
  v1::OpenSessionResponse opened;
  {
    const DeferInterrupts defer;  // an opened session must be known, to be closed again
    opened = client::begin_session(context.client(), std::move(scene), options.session);
  }
  for (const auto& issue : opened.issues()) fmt::print(stderr, "{}\n", describe(issue));
  if (kind != client::FileKind::kScene) print_assumptions(context, options.scene, opened.session());
  if (!options.no_wait) {
    try {
      follow_opening(context, opened, options.wait_s);
    } catch (const ClientError&) {
      if (interrupted()) close_quietly(context, opened.session());
      throw;
    }
  }
  const auto status = context.session<client::OpenSession>(opened.session()).status();
  if (status.has_result()) note_failure(context, status.result());
  if (status.has_model() && !status.model().met_tolerance())
    fmt::print(stderr, "warning: the model misses its tolerance: {}\n", status.model().message());
  if (context.json) return print_json(status);
  fmt::print("session {}: {}, {}\n", title(status), kind_of(status).sizes(status),
             state_words(status));
  if (!status.has_model()) return;
  fmt::print("model: {}, {:.2f} s{}\n", describe(status.model()), status.model().build_s(),
             status.model().from_cache() ? ", from the cache" : "");
  if (status.model().met_tolerance() && !status.model().message().empty())
    fmt::print("note: {}\n", status.model().message());
}

}  // namespace

void add_open_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<OpenOptions>();
  auto* command =
      subcommand(app, "open", "Open a scene as a session: upload it, build its model, solve it",
                 "limber open scene.json --session robot\n  limber open mesh.msh\n  limber open "
                 "--sample flower --optimise all");
  auto* file = command->add_option(
      "scene", options->scene,
      "Scene file (JSON), whose mesh file is uploaded; a job of the public "
      "relaxation code (its folder); the name of a sample; or, with defaults "
      "that it prints, a mesh of tets (.msh, .vtk, .vtu, .mesh, .ele, .veg, "
      ".abq), a closed surface to be filled with tets (.obj, .ply, .stl, .off, .glb), or "
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
  command->add_option("--tets", options->filling.tets,
                      "Of a surface: about so many tets (default: 5000)");
  command->add_option("--within", options->filling.within,
                      "Of a surface: keep within this share of the body's length (default: 0.02)");
  auto* stiffness = command->add_option(
      "--stiffness", options->stiffness,
      "Of a body: a file with a number for each vertex of its surface, by which its stiffness is "
      "multiplied there; without a surface, for each node. A text, a .ply or JSON of groups");
  command->add_option("--stiffness-of", options->painted_points, "What the numbers are of")
      ->needs(stiffness)
      ->transform(CLI::CheckedTransformer(std::map<std::string, v1::PaintedPoints>{
          {"surface", v1::PAINTED_POINTS_SURFACE}, {"nodes", v1::PAINTED_POINTS_NODES}}));
  command
      ->add_option("--stiffness-as", options->painted_quantity,
                   "What the numbers are: factors, or Young's moduli [Pa]")
      ->needs(stiffness)
      ->transform(CLI::CheckedTransformer(std::map<std::string, v1::PaintedQuantity>{
          {"factor", v1::PAINTED_QUANTITY_FACTOR},
          {"pascal", v1::PAINTED_QUANTITY_YOUNGS_MODULUS}}));
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
