// cold, add, move, replace, remove, ends, dynamics, material: edits of elastic bodies, each a
// revision.

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "clients/cli/bodies/commands.h"
#include "clients/cli/bodies/material_variables.h"
#include "clients/cli/print.h"
#include "clients/cli/receipt.h"
#include "clients/cpp/bodies/session.h"
#include "engine/base/checked_number.h"

namespace limber::cli::bodies {
namespace {

using client::BodySession;

struct ConstraintOptions {
  std::string session, axes;
  std::uint64_t id = 0;
  unsigned frame = 0;
  std::vector<unsigned> nodes;
  std::optional<unsigned> surface_vertex;
  std::string surface_point;
  std::vector<double> position, displacement, velocity;
  std::optional<double> weight;
  bool exact = false;
  std::optional<unsigned> until;
  std::vector<std::string> path;
  std::optional<double> ease_in, ease_out, reach;
};

/// F,X,Y,Z: a further key of a path; nothing for other texts.
std::optional<v1::PathKey> path_key(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream parts(text);
  v1::PathKey key;
  std::string part;
  for (int i = 0; std::getline(parts, part, ','); ++i) {
    if (i == 0) {
      const auto frame = parse_number<std::uint32_t>(part);
      if (!frame) return std::nullopt;
      key.set_frame(*frame);
      continue;
    }
    const auto number = parse_number<double>(part);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  if (numbers.size() != 3 || text.ends_with(',')) return std::nullopt;
  *key.mutable_target() = client::message(vector(numbers));
  return key;
}

std::string check_path_key(const std::string& text) {
  if (path_key(text)) return {};
  return "a key is a frame and a target of the constraint's kind, e.g. 40,0,0.1,0";
}

/// T,W0,W1,W2: a triangle and the weights of its corners; nothing for other texts.
std::optional<v1::SurfacePoint> surface_point(const std::string& text) {
  v1::SurfacePoint point;
  std::istringstream parts(text);
  std::string part;
  for (int i = 0; std::getline(parts, part, ','); ++i) {
    if (i == 0) {
      const auto triangle = parse_number<std::uint32_t>(part);
      if (!triangle) return std::nullopt;
      point.set_triangle(*triangle);
    } else {
      const auto weight = parse_number<double>(part);
      if (!weight) return std::nullopt;
      point.add_weights(*weight);
    }
  }
  if (point.weights_size() != 3 || text.ends_with(',')) return std::nullopt;
  return point;
}

std::string check_surface_point(const std::string& text) {
  if (surface_point(text)) return {};
  return "a point is a triangle and the weights of its three corners, e.g. 120,0.5,0.25,0.25";
}

v1::Constraint constraint(const ConstraintOptions& options) {
  v1::Constraint message;
  message.set_id(options.id);
  message.set_frame(options.frame);
  for (const unsigned node : options.nodes) message.add_nodes(node);
  if (options.surface_vertex) message.set_surface_vertex(*options.surface_vertex);
  if (!options.surface_point.empty())
    *message.mutable_point() = surface_point(options.surface_point).value();
  for (const char axis : options.axes)
    message.add_axes(axis == 'x' ? v1::AXIS_X : axis == 'y' ? v1::AXIS_Y : v1::AXIS_Z);
  if (!options.position.empty())
    *message.mutable_position() = client::message(vector(options.position));
  else if (!options.velocity.empty())
    *message.mutable_velocity() = client::message(vector(options.velocity));
  else
    *message.mutable_displacement() = client::message(vector(options.displacement));
  if (options.exact) message.set_exact(true);
  if (options.weight) message.set_weight(*options.weight);
  if (options.until) message.add_path()->set_frame(*options.until);
  for (const std::string& key : options.path) *message.add_path() = path_key(key).value();
  if (options.ease_in) message.set_ease_in(*options.ease_in);
  if (options.ease_out) message.set_ease_out(*options.ease_out);
  if (options.reach) message.set_reach(*options.reach);
  return message;
}

std::string check_axes(const std::string& axes) {
  for (std::size_t i = 0; i < axes.size(); ++i)
    if (std::string("xyz").find(axes[i]) == std::string::npos ||
        axes.find(axes[i], i + 1) != std::string::npos)
      return "axes are one to three of xyz, e.g. xz";
  return {};
}

void add_constraint_options(CLI::App& command, ConstraintOptions& options) {
  auto* held = command.add_option_group("held", "What is held");
  held->add_option("--node,--nodes", options.nodes,
                   "Node ids, from 0; several are held by their mean");
  held->add_option("--surface-vertex", options.surface_vertex,
                   "A vertex, from 0, of the surface that the scene names");
  held->add_option(
          "--surface-point", options.surface_point,
          "T,W0,W1,W2: the point of triangle T, from 0, with these weights of its corners, "
          "whose sum is 1; of the surface that the scene names, else of the mesh's")
      ->check(CLI::Validator(check_surface_point, "POINT"));
  held->require_option(1);
  command.add_option("--frame", options.frame, "Frame, from 0")->required();
  auto* target =
      command.add_option_group("target", "Where the node (or mean) shall be, or how it shall move");
  target->add_option("--position", options.position, "A point x y z of the mesh's space")
      ->expected(3);
  target->add_option("--displacement", options.displacement, "From the rest position: x y z")
      ->expected(3);
  target
      ->add_option("--velocity", options.velocity,
                   "Of the shown frames, half the displacement from the frame before to the frame "
                   "after times "
                   "frames per second: x y z [length unit / s]")
      ->expected(3);
  target->require_option(1);
  auto* until = command.add_option("--until", options.until,
                                   "A hold: in every frame from --frame to this one");
  command
      .add_option(
          "--path", options.path,
          "F,X,Y,Z: a further key, as often as there are keys; the constraint acts in every "
          "frame from --frame to the last of them")
      ->check(CLI::Validator(check_path_key, "KEY"))
      ->excludes(until);
  command.add_option("--ease-in", options.ease_in,
                     "How far a path begins at rest, 0 to 1 (default: 1)");
  command.add_option("--ease-out", options.ease_out,
                     "How far a path ends at rest, 0 to 1 (default: 1)");
  command.add_option(
      "--reach", options.reach,
      "How far in time it acts [s]; farther away the motion stays as it is without it");
  command.add_option("--axes", options.axes, "Which axes count, e.g. xz (default: all)")
      ->check(CLI::Validator(check_axes, "AXES"));
  auto* weight = command.add_option("--weight", options.weight,
                                    "gamma > 0 of a soft constraint (default: 100)");
  command.add_flag("--exact", options.exact, "Hold exactly")->excludes(weight);
}

void cold_command(CLI::App& app, Context& context) {
  auto session = std::make_shared<std::string>();
  auto* command = subcommand(app, "cold", "Solve the session's problem again from its base motion",
                             "limber cold flower");
  command->add_option("session", *session, "Session")->required();
  command->callback([&context, session] {
    v1::SolveColdResponse started;
    started.set_job(context.session<BodySession>(*session).solve_cold());
    if (context.json) return print_json(started);
    fmt::print("job {}\n", started.job());
  });
}

void add_constraint_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<ConstraintOptions>();
  auto* command = subcommand(
      app, "add", "Add a constraint: in this frame, this node is there, or moves so",
      "limber add flower --node 12 --frame 40 --displacement 0 0 0.2\n"
      "  limber add flower --node 3 4 5 --frame 60 --position 1 0.5 0 --axes xy --exact\n"
      "  limber add flower --node 12 --frame 50 --velocity 0 0 1.5\n"
      "  limber add cow --surface-vertex 120 --frame 40 --displacement 0 0.1 0\n"
      "  limber add cow --surface-point 7,0.5,0.25,0.25 --frame 60 --position 0 1 0.2 --exact");
  command->add_option("session", options->session, "Session")->required();
  add_constraint_options(*command, *options);
  command->callback([&context, options] {
    auto session = context.session<BodySession>(options->session);
    print_receipt(context, session.add(constraint(*options)));
  });
}

void replace_constraint_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<ConstraintOptions>();
  auto* command = subcommand(app, "replace", "Put another constraint in the place of one",
                             "limber replace flower 2 --node 12 --frame 50 --displacement 0 0 0.3");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("id", options->id, "Constraint")->required();
  add_constraint_options(*command, *options);
  command->callback([&context, options] {
    auto session = context.session<BodySession>(options->session);
    print_receipt(context, session.replace(constraint(*options)));
  });
}

void move_constraint_command(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    std::uint64_t id = 0;
    std::vector<double> target;
  };
  auto options = std::make_shared<Options>();
  auto* command = subcommand(app, "move", "Give a constraint another target, of the kind it has",
                             "limber move flower 2 0.1 0 0.25");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("id", options->id, "Constraint")->required();
  command
      ->add_option("target", options->target,
                   "x y z: a position, a displacement or a velocity, as it was added")
      ->required()
      ->expected(3);
  command->callback([&context, options] {
    auto session = context.session<BodySession>(options->session);
    print_receipt(context, session.move(options->id, vector(options->target)));
  });
}

void remove_constraint_command(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    std::vector<std::uint64_t> ids;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "remove", "Remove constraints, as one revision", "limber remove flower 2 3");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("ids", options->ids, "Constraints")->required();
  command->callback([&context, options] {
    auto session = context.session<BodySession>(options->session);
    print_receipt(context, session.remove(options->ids));
  });
}

void ends_command(CLI::App& app, Context& context) {
  struct Options {
    std::string session, first, last;
  };
  static const std::map<std::string, v1::EndCondition> kEnds = {
      {"free", v1::END_CONDITION_FREE},
      {"position", v1::END_CONDITION_PINNED_POSITION},
      {"position_velocity", v1::END_CONDITION_PINNED_POSITION_VELOCITY},
      {"cyclic", v1::END_CONDITION_CYCLIC}};
  auto options = std::make_shared<Options>();
  auto* command = subcommand(app, "ends",
                             "What holds the motion at its first and last frame; cyclic at both: a "
                             "loop, in which the last frame leads into the first",
                             "limber ends flower --first position_velocity --last free");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("--first", options->first, "First frame")
      ->required()
      ->check(CLI::IsMember(kEnds));
  command->add_option("--last", options->last, "Last frame")
      ->required()
      ->check(CLI::IsMember(kEnds));
  command->callback([&context, options] {
    auto session = context.session<BodySession>(options->session);
    print_receipt(context, session.ends(kEnds.at(options->first), kEnds.at(options->last)));
  });
}

struct DynamicsOptions {
  std::string session;
  client::DynamicsChange change;
};

void dynamics_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<DynamicsOptions>();
  auto* command = subcommand(
      app, "dynamics", "How fast and how lively the body moves; what is not named stays as it is",
      "limber dynamics flower --period-frames 30 --damping-ratio 0.05");
  command->add_option("session", options->session, "Session")->required();
  auto* values = command->add_option_group("values", "At least one of");
  values->add_option("--frames-per-second", options->change.frames_per_second,
                     "Frames per second, > 0");
  values->add_option("--period-frames", options->change.period_frames,
                     "Frames of one swing of the lowest elastic mode; 0: as the materials say");
  values->add_option("--damping-ratio", options->change.damping_ratio,
                     "Of critical, in [0, 1): of the lowest elastic mode");
  values->add_option("--force-smoothing", options->change.force_smoothing,
                     "About the time in which control forces change [s]; 0: none");
  values->add_option("--inertia", options->change.inertia,
                     "Under a base motion: 1 lags behind as a body would, 0 follows; at most 10");
  values
      ->add_option("--discretisation", options->change.discretisation,
                   "sampled: free motion is exact at the frames; differences: as published")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, v1::TimeDiscretisation>{
              {"sampled", v1::TIME_DISCRETISATION_SAMPLED},
              {"differences", v1::TIME_DISCRETISATION_DIFFERENCES}},
          CLI::ignore_case));
  values->require_option(1, 6);
  command->callback([&context, options] {
    auto session = context.session<BodySession>(options->session);
    print_receipt(context, session.dynamics(options->change));
  });
}

struct MaterialOptions {
  std::string session, optimise;
  bool freeze = false, reset = false;
};

/// Rounding errors of zero are not shown.
std::string small_number(double value) {
  return fmt::format("{:.3g}", std::abs(value) < 1e-9 ? 0 : value);
}

void print_material(const Context& context, const v1::GetMaterialResponse& material) {
  if (context.json) return print_json(material);
  Table table(
      {"mode", "frequency [Hz]", "damping ratio", "decay [1/s]", "scene [Hz]", "scene damping"});
  for (int k = 0; k < material.modes_size(); ++k) {
    const auto& mode = material.modes(k);
    const auto& initial = material.initial(k);
    table.add({std::to_string(k + 1), fmt::format("{:.4g}", mode.frequency_hz()),
               small_number(mode.damping_ratio()), small_number(mode.decay_per_s()),
               fmt::format("{:.4g}", initial.frequency_hz()),
               small_number(initial.damping_ratio())});
  }
  fmt::print("{}", table.text());
  fmt::print("optimised: {}; control forces {:.4g} (comparable between materials), revision {}{}\n",
             words(v1::MaterialVariables_Name(material.variables()), "MATERIAL_VARIABLES_"),
             material.result().unit_force_energy(), material.result().revision(),
             material.result().converged() ? "" : " (not final)");
}

void material(Context& context, const MaterialOptions& options) {
  auto session = context.session<BodySession>(options.session);
  if (options.freeze || !options.optimise.empty()) {
    const auto variables =
        options.freeze ? v1::MATERIAL_VARIABLES_MOTION : kMaterialVariables.at(options.optimise);
    const auto fitted =
        options.reset ? client::FittedMaterial::kForgotten : client::FittedMaterial::kKept;
    return print_receipt(context, session.optimise(variables, fitted));
  }
  if (options.reset) return print_receipt(context, session.reset_material());
  print_material(context, session.material());
}

void material_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<MaterialOptions>();
  auto* command = subcommand(
      app, "material",
      "The material of the newest result in SI units; or what of it is optimised from now on",
      "limber material flower --optimise all");
  command->add_option("session", options->session, "Session")->required();
  auto* optimise =
      command
          ->add_option("--optimise,--optimize", options->optimise,
                       "motion: control forces only; dynamics: and frequencies and damping; all: "
                       "and the modes (open the scene with \"material_optimisation\": "
                       "{\"variables\": \"MATERIAL_VARIABLES_ALL\"} for more modes to mix)")
          ->check(CLI::IsMember({"motion", "dynamics", "all"}));
  command->add_flag("--freeze", options->freeze, "Keep what was fitted and optimise forces only")
      ->excludes(optimise);
  command->add_flag("--reset", options->reset, "Forget what was fitted: the scene's own material");
  command->callback([&context, options] { material(context, *options); });
}

}  // namespace

void add_edit_commands(CLI::App& app, Context& context) {
  cold_command(app, context);
  add_constraint_command(app, context);
  move_constraint_command(app, context);
  replace_constraint_command(app, context);
  remove_constraint_command(app, context);
  ends_command(app, context);
  dynamics_command(app, context);
  material_command(app, context);
}

}  // namespace limber::cli::bodies
