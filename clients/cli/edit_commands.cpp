// add, move, replace, remove, ends, dynamics, material, undo, redo, edit-script: edits, each a
// revision.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>

#include "clients/cli/context.h"
#include "clients/cli/edits.h"
#include "clients/cli/material_variables.h"
#include "clients/cli/print.h"
#include "proto/json_text.h"

namespace limber::cli {

v1::Vector3 vector(const std::vector<double>& values) {
  v1::Vector3 message;
  message.set_x(values.at(0));
  message.set_y(values.at(1));
  message.set_z(values.at(2));
  return message;
}

v1::EditResponse send(Context& context, const std::string& session,
                      const std::vector<v1::Edit>& edits) {
  v1::EditRequest request;
  request.set_session(session);
  for (const auto& edit : edits) *request.add_edits() = edit;
  return context.client().call(request);
}

void print_receipt(const Context& context, const v1::EditResponse& response) {
  for (const auto& issue : response.issues()) fmt::print(stderr, "{}\n", describe(issue));
  if (context.json) return print_json(response);
  std::string touched;
  for (const auto id : response.constraint_ids())
    if (id != 0) touched += fmt::format("{}{}", touched.empty() ? ", constraint " : ", ", id);
  for (const auto id : response.keyframe_ids())
    if (id != 0) touched += fmt::format(", keyframe {}", id);
  for (const auto id : response.target_ids())
    if (id != 0) touched += fmt::format(", target {}", id);
  fmt::print("revision {}{}\n", response.revision(), touched);
}

namespace {

using client::ClientError;

struct ConstraintOptions {
  std::string session, axes;
  std::uint64_t id = 0;
  unsigned frame = 0;
  std::vector<unsigned> nodes;
  std::vector<double> position, displacement, velocity;
  std::optional<double> weight;
  bool exact = false;
};

v1::Constraint constraint(const ConstraintOptions& options) {
  v1::Constraint message;
  message.set_id(options.id);
  message.set_frame(options.frame);
  for (const unsigned node : options.nodes) message.add_nodes(node);
  for (const char axis : options.axes)
    message.add_axes(axis == 'x' ? v1::AXIS_X : axis == 'y' ? v1::AXIS_Y : v1::AXIS_Z);
  if (!options.position.empty())
    *message.mutable_position() = vector(options.position);
  else if (!options.velocity.empty())
    *message.mutable_velocity() = vector(options.velocity);
  else
    *message.mutable_displacement() = vector(options.displacement);
  if (options.exact) message.set_exact(true);
  if (options.weight) message.set_weight(*options.weight);
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
  command
      .add_option("--node,--nodes", options.nodes,
                  "Node ids, from 0; several are held by their mean")
      ->required();
  command.add_option("--frame", options.frame, "Frame, from 0")->required();
  auto* target =
      command.add_option_group("target", "Where the node (or mean) shall be, or how it shall move");
  target->add_option("--position", options.position, "A point x y z of the mesh's space")
      ->expected(3);
  target->add_option("--displacement", options.displacement, "From the rest position: x y z")
      ->expected(3);
  target
      ->add_option(
          "--velocity", options.velocity,
          "Of the shown frames, half the way from the frame before to the frame after times "
          "frames per second: x y z [length unit / s]")
      ->expected(3);
  target->require_option(1);
  command.add_option("--axes", options.axes, "Which axes count, e.g. xz (default: all)")
      ->check(CLI::Validator(check_axes, "AXES"));
  auto* weight = command.add_option("--weight", options.weight,
                                    "gamma > 0 of a soft constraint (default: 100)");
  command.add_flag("--exact", options.exact, "Hold exactly")->excludes(weight);
}

void add_constraint_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<ConstraintOptions>();
  auto* command = subcommand(
      app, "add", "Add a constraint: in this frame, this node is there, or moves so",
      "limber add flower --node 12 --frame 40 --displacement 0 0 0.2\n"
      "  limber add flower --node 3 4 5 --frame 60 --position 1 0.5 0 --axes xy --exact\n"
      "  limber add flower --node 12 --frame 50 --velocity 0 0 1.5");
  command->add_option("session", options->session, "Session")->required();
  add_constraint_options(*command, *options);
  command->callback([&context, options] {
    v1::Edit edit;
    *edit.mutable_add()->mutable_constraint() = constraint(*options);
    print_receipt(context, send(context, options->session, {edit}));
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
    v1::Edit edit;
    *edit.mutable_replace()->mutable_constraint() = constraint(*options);
    print_receipt(context, send(context, options->session, {edit}));
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
    v1::Edit edit;
    edit.mutable_move()->set_id(options->id);
    *edit.mutable_move()->mutable_target() = vector(options->target);
    print_receipt(context, send(context, options->session, {edit}));
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
    std::vector<v1::Edit> edits(options->ids.size());
    for (std::size_t i = 0; i < edits.size(); ++i)
      edits[i].mutable_remove()->set_id(options->ids[i]);
    print_receipt(context, send(context, options->session, edits));
  });
}

void ends_command(CLI::App& app, Context& context) {
  struct Options {
    std::string session, first, last;
  };
  static const std::map<std::string, v1::EndCondition> kEnds = {
      {"free", v1::END_CONDITION_FREE},
      {"position", v1::END_CONDITION_PINNED_POSITION},
      {"position_velocity", v1::END_CONDITION_PINNED_POSITION_VELOCITY}};
  auto options = std::make_shared<Options>();
  auto* command = subcommand(app, "ends", "What holds the motion at its first and last frame",
                             "limber ends flower --first position_velocity --last free");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("--first", options->first, "First frame")
      ->required()
      ->check(CLI::IsMember({"free", "position", "position_velocity"}));
  command->add_option("--last", options->last, "Last frame")
      ->required()
      ->check(CLI::IsMember({"free", "position", "position_velocity"}));
  command->callback([&context, options] {
    v1::Edit edit;
    edit.mutable_set_ends()->set_first_end(kEnds.at(options->first));
    edit.mutable_set_ends()->set_last_end(kEnds.at(options->last));
    print_receipt(context, send(context, options->session, {edit}));
  });
}

struct DynamicsOptions {
  std::string session;
  std::optional<double> frames_per_second, period_frames, damping_ratio;
};

/// The wire knows the whole only: what is not named is read first, and sent again unless somebody
/// has edited meanwhile.
v1::EditResponse change_dynamics(Context& context, const DynamicsOptions& options) {
  const auto deadline =
      std::chrono::steady_clock::now() + milliseconds(std::min(context.timeout_s, 10.0));
  while (true) {
    v1::GetSessionRequest get;
    get.set_session(options.session);
    get.set_with_scene(true);
    const auto known = context.client().call(get);
    v1::EditRequest request;
    request.set_session(options.session);
    request.set_expected_revision(known.status().revision());
    auto& dynamics = *request.add_edits()->mutable_set_dynamics();
    dynamics = known.scene().dynamics();
    if (options.frames_per_second) dynamics.set_frames_per_second(*options.frames_per_second);
    if (options.period_frames) dynamics.set_period_frames(*options.period_frames);
    if (options.damping_ratio) dynamics.set_damping_ratio(*options.damping_ratio);
    try {
      return context.client().call(request);
    } catch (const ClientError& error) {
      if (error.field() != "expected_revision" || std::chrono::steady_clock::now() > deadline)
        throw;
    }
  }
}

void dynamics_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<DynamicsOptions>();
  auto* command =
      subcommand(app, "dynamics", "How fast the body moves; what is not named stays as it is",
                 "limber dynamics flower --period-frames 30 --damping-ratio 0.05");
  command->add_option("session", options->session, "Session")->required();
  auto* values = command->add_option_group("values", "At least one of");
  values->add_option("--frames-per-second", options->frames_per_second, "Frames per second, > 0");
  values->add_option("--period-frames", options->period_frames,
                     "Frames of one swing of the lowest elastic mode; 0: as the materials say");
  values->add_option("--damping-ratio", options->damping_ratio, "Of critical, in [0, 1)");
  values->require_option(1, 3);
  command->callback(
      [&context, options] { print_receipt(context, change_dynamics(context, *options)); });
}

struct MaterialOptions {
  std::string session, optimise;
  bool freeze = false, reset = false;
};

/// Rounding of what is zero is nobody's business.
std::string small_number(double value) {
  return fmt::format("{:.3g}", std::abs(value) < 1e-9 ? 0 : value);
}

void print_material(Context& context, const std::string& session) {
  v1::GetMaterialRequest request;
  request.set_session(session);
  const auto material = context.client().call(request);
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

void change_material(Context& context, const MaterialOptions& options) {
  std::vector<v1::Edit> edits;
  if (options.reset) edits.emplace_back().mutable_reset_material();
  if (options.freeze || !options.optimise.empty()) {
    edits.emplace_back().mutable_set_material()->set_variables(
        options.freeze ? v1::MATERIAL_VARIABLES_MOTION : kMaterialVariables.at(options.optimise));
  }
  if (edits.empty()) return print_material(context, options.session);
  print_receipt(context, send(context, options.session, edits));
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
  command->callback([&context, options] { change_material(context, *options); });
}

void undo_redo_commands(CLI::App& app, Context& context) {
  for (const bool undo : {true, false}) {
    const std::string name = undo ? "undo" : "redo";
    auto session = std::make_shared<std::string>();
    auto* command =
        subcommand(app, name, undo ? "Take the newest revision back" : "Bring back what undo took",
                   "limber " + name + " flower");
    command->add_option("session", *session, "Session")->required();
    command->callback([&context, session, undo] {
      v1::Edit edit;
      if (undo)
        edit.mutable_undo();
      else
        edit.mutable_redo();
      print_receipt(context, send(context, *session, {edit}));
    });
  }
}

/// One line of an edit script: an edit, or `{"edits": [...]}` for several that are one revision.
v1::EditRequest parse_line(const std::string& line, int number) {
  v1::EditRequest request;
  const bool several = line.find("\"edits\"") != std::string::npos;
  const auto fault =
      several ? json::read_message(line, request) : json::read_message(line, *request.add_edits());
  if (!fault) return request;
  throw ClientError(
      v1::ERROR_CODE_INVALID_ARGUMENT,
      fmt::format("line {}{}{}", number, fault->field.empty() ? "" : ": ", fault->field),
      fmt::format("is no {}: {}", several ? "list of edits" : "edit", fault->message));
}

/// The server knows edits, not lines.
v1::EditResponse send_line(Context& context, const v1::EditRequest& request, int number) {
  try {
    return context.client().call(request);
  } catch (const client::Unreachable&) {
    throw;
  } catch (const ClientError& error) {
    throw ClientError(error.code(), fmt::format("line {}: {}", number, error.field()), error.what(),
                      error.details());
  }
}

struct ScriptOptions {
  std::string session, file, wait = "final";
};

void run_script(Context& context, const ScriptOptions& options) {
  std::ifstream file;
  if (options.file != "-") {
    file.open(options.file);
    if (!file) throw ClientError(v1::ERROR_CODE_IO, "file", "cannot read " + options.file);
  }
  std::istream& in = options.file == "-" ? std::cin : file;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos || line[start] == '#') continue;
    auto request = parse_line(line, number);
    request.set_session(options.session);
    const auto response = send_line(context, request, number);
    print_receipt(context, response);
    if (options.wait == "none") continue;
    v1::WaitRequest wait;
    wait.set_session(options.session);
    wait.set_revision(response.revision());
    wait.set_until(wait_until(options.wait));
    const auto result = context.client().call(wait, client::Milliseconds{70000}).result();
    if (context.json)
      print_json(result);
    else
      fmt::print("  {}, energy {:.6g}, constraint error {:.3g}, {:.2f} ms{}\n",
                 status_words(result), result.total_energy(), result.max_constraint_error(),
                 result.since_edit_ms(), motion_words(result));
    note_failure(context, result);
  }
}

void script_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<ScriptOptions>();
  auto* command = subcommand(
      app, "edit-script", "Send the edits of a file, one line after the other",
      "limber edit-script flower edits.jsonl\n"
      "where a line is an edit as JSON, or {\"edits\": [...]} for several that are one revision:\n"
      R"(  {"add": {"constraint": {"frame": 40, "nodes": [12], "displacement": {"z": 0.2}}}})"
      "\n"
      R"(  {"edits": [{"move": {"id": "1", "target": {"z": 0.1}}}, {"remove": {"id": "2"}}]})"
      "\n  {\"undo\": {}}\nEmpty lines and lines that begin with # are skipped.");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("file", options->file, "JSON lines; - for standard input")->required();
  command
      ->add_option("--wait", options->wait,
                   "After each line, wait for its result: none, first, final or checked")
      ->check(CLI::IsMember({"none", "first", "final", "checked"}))
      ->capture_default_str();
  command->callback([&context, options] { run_script(context, *options); });
}

}  // namespace

void add_edit_commands(CLI::App& app, Context& context) {
  add_constraint_command(app, context);
  move_constraint_command(app, context);
  replace_constraint_command(app, context);
  remove_constraint_command(app, context);
  ends_command(app, context);
  dynamics_command(app, context);
  material_command(app, context);
  undo_redo_commands(app, context);
  script_command(app, context);
}

}  // namespace limber::cli
