// support, bring, release, hold, load, push, gravity: edits of structures of beams; load and
// gravity of rod linkages, too.

#include <fmt/format.h>

#include <memory>
#include <optional>

#include "clients/cli/context.h"
#include "clients/cli/edits.h"

namespace limber::cli {
namespace {

void add_beam_session(CLI::App& command, std::string& session) {
  command.add_option("session", session, "Session of a structure of beams")->required();
}

std::string check_beam_axes(const std::string& axes) {
  for (std::size_t i = 0; i < axes.size(); ++i)
    if (std::string("xyz").find(axes[i]) == std::string::npos ||
        axes.find(axes[i], i + 1) != std::string::npos)
      return "some of xyz are expected, e.g. xz";
  return {};
}

bool has(const std::string& axes, char axis) { return axes.find(axis) != std::string::npos; }

/// @param axes  of BeamSupport or BeamMotion
CLI::Option* add_axes(CLI::App& command, std::vector<double>& axes) {
  return command
      .add_option("--axes", axes,
                  "Two directions x y z in place of x and y, after one another; the third is "
                  "perpendicular to both")
      ->expected(6);
}

template <class Message>
void set_axes(const std::vector<double>& axes, Message& message) {
  if (axes.empty()) return;
  *message.mutable_x_axis() = vector({axes.begin(), axes.begin() + 3});
  *message.mutable_y_axis() = vector({axes.begin() + 3, axes.end()});
}

void add_support(CLI::App& app, Context& context) {
  struct Options {
    std::string session, translations = "xyz", rotations = "xyz";
    unsigned node = 0;
    std::vector<double> axes;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "support", "Hold a node of a structure of beams where it is drawn",
                 "limber support roof 12 --rotations \"\"\n"
                 "  limber support roof 12 --translations z --rotations xyz\n"
                 "  limber support roof 12 --translations x --rotations yz --axes 1 1 0 -1 1 0");
  add_beam_session(*command, options->session);
  command->add_option("node", options->node, "Node, from 0")->required();
  const CLI::Validator axes(check_beam_axes, "AXES");
  command->add_option("--translations", options->translations, "Along these (default: xyz)")
      ->check(axes);
  command->add_option("--rotations", options->rotations, "About these (default: xyz)")->check(axes);
  add_axes(*command, options->axes);
  command->callback([&context, options] {
    v1::Edit edit;
    auto& support = *edit.mutable_set_beam_support()->mutable_support();
    support.set_node(options->node);
    support.set_fix_x(has(options->translations, 'x'));
    support.set_fix_y(has(options->translations, 'y'));
    support.set_fix_z(has(options->translations, 'z'));
    support.set_fix_rotation_x(has(options->rotations, 'x'));
    support.set_fix_rotation_y(has(options->rotations, 'y'));
    support.set_fix_rotation_z(has(options->rotations, 'z'));
    set_axes(options->axes, support);
    print_receipt(context, send(context, options->session, {edit}));
  });
}

void add_bring(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    unsigned node = 0;
    std::optional<double> x, y, z, rotation_x, rotation_y, rotation_z;
    std::vector<double> position, rotation, axes;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "bring",
                 "Move a node of a structure of beams, held or not, and hold it there; directions "
                 "that are not given stay as they are",
                 "limber bring arch 40 --x -0.5\n  limber bring arch 0 --rotation 0 0.3 0\n"
                 "  limber bring arch 0 --rotation-y 0.3\n"
                 "  limber bring roof 12 --x 0.1 --axes 1 1 0 -1 1 0");
  add_beam_session(*command, options->session);
  command->add_option("node", options->node, "Node, from 0")->required();
  auto* way = command->add_option_group("way", "Where to");
  auto* x = way->add_option("--x", options->x, "From where it is drawn, in m");
  auto* y = way->add_option("--y", options->y, "The same along y");
  auto* z = way->add_option("--z", options->z, "The same along z");
  way->add_option("--position", options->position, "To this point x y z")
      ->expected(3)
      ->excludes(x)
      ->excludes(y)
      ->excludes(z);
  auto* rotation = way->add_option("--rotation", options->rotation,
                                   "To this rotation vector from rest, in radian")
                       ->expected(3);
  way->add_option("--rotation-x", options->rotation_x,
                  "About this axis alone, in radian; the others stay as they are")
      ->excludes(rotation);
  way->add_option("--rotation-y", options->rotation_y, "The same about y")->excludes(rotation);
  way->add_option("--rotation-z", options->rotation_z, "The same about z")->excludes(rotation);
  way->require_option(1, 6);
  add_axes(*command, options->axes);
  command->callback([&context, options] {
    v1::Edit edit;
    auto& change = *edit.mutable_move_beam_node();
    auto& motion = *change.mutable_motion();
    motion.set_node(options->node);
    if (options->x) motion.set_x(*options->x);
    if (options->y) motion.set_y(*options->y);
    if (options->z) motion.set_z(*options->z);
    if (!options->rotation.empty()) *motion.mutable_rotation() = vector(options->rotation);
    if (options->rotation_x) motion.set_rotation_x(*options->rotation_x);
    if (options->rotation_y) motion.set_rotation_y(*options->rotation_y);
    if (options->rotation_z) motion.set_rotation_z(*options->rotation_z);
    set_axes(options->axes, motion);
    if (!options->position.empty()) *change.mutable_position() = vector(options->position);
    print_receipt(context, send(context, options->session, {edit}));
  });
}

/// A command that takes a node and nothing else.
template <class Fill>
void add_of_node(CLI::App& app, Context& context, const char* name, const char* description,
                 const Fill& fill) {
  auto session = std::make_shared<std::string>();
  auto node = std::make_shared<unsigned>(0);
  auto* command = subcommand(app, name, description, fmt::format("limber {} arch 40", name));
  add_beam_session(*command, *session);
  command->add_option("node", *node, "Node, from 0")->required();
  command->callback([&context, session, node, fill] {
    v1::Edit edit;
    fill(edit, *node);
    print_receipt(context, send(context, *session, {edit}));
  });
}

void add_load(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    std::optional<unsigned> node, element, joint;
    std::vector<double> force, moment;
    double torque = 0;
    bool follows = false;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "load",
                 "Replace what loads a node or an element of a structure of beams, or a joint of a "
                 "rod linkage; no force, moment or torque takes it away",
                 "limber load arch --node 20 --force 0 0 -50\n"
                 "  limber load arch --element 3 --force 0 0 -10\n"
                 "  limber load shelter --joint 5 --force 0 0 -20 --torque 0.5");
  command
      ->add_option("session", options->session, "Session of a structure of beams or a rod linkage")
      ->required();
  auto* at = command->add_option_group("at", "What is loaded");
  at->add_option("--node", options->node, "A node, from 0");
  auto* element = at->add_option("--element", options->element, "An element, from 0");
  auto* joint = at->add_option("--joint", options->joint, "A joint of a rod linkage, from 0");
  at->require_option(1);
  command->add_option("--force", options->force, "x y z in N; of an element in N/m")->expected(3);
  command->add_option("--moment", options->moment, "x y z in N m")->expected(3)->excludes(element);
  command->add_option("--torque", options->torque, "In N m, opens the joint; negative: closes it")
      ->needs(joint);
  command
      ->add_flag("--follows", options->follows,
                 "It turns with what it loads; those of joints keep their directions")
      ->excludes(joint);
  command->callback([&context, options] {
    v1::Edit edit;
    const auto force = options->force.empty() ? v1::Vector3{} : vector(options->force);
    if (options->joint) {
      auto& load = *edit.mutable_set_joint_load()->mutable_load();
      load.set_joint(*options->joint);
      *load.mutable_force() = force;
      if (!options->moment.empty()) *load.mutable_moment() = vector(options->moment);
      load.set_torque(options->torque);
    } else if (options->element) {
      auto& load = *edit.mutable_set_beam_element_load()->mutable_load();
      load.set_element(*options->element);
      *load.mutable_force() = force;
      load.set_follows(options->follows);
    } else {
      auto& load = *edit.mutable_set_beam_load()->mutable_load();
      load.set_node(*options->node);
      *load.mutable_force() = force;
      if (!options->moment.empty()) *load.mutable_moment() = vector(options->moment);
      load.set_follows(options->follows);
    }
    print_receipt(context, send(context, options->session, {edit}));
  });
}

void add_push(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    unsigned node = 0;
    std::vector<double> force, moment;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "push",
                 "Push a node of a structure of beams and let it go: does it come back, "
                 "or snap to another shape?",
                 "limber push arch 20 --force 0 0 -500");
  add_beam_session(*command, options->session);
  command->add_option("node", options->node, "Node, from 0")->required();
  auto* how = command->add_option_group("how", "What pushes");
  how->add_option("--force", options->force, "x y z in N")->expected(3);
  how->add_option("--moment", options->moment, "x y z in N m")->expected(3);
  how->require_option(1, 2);
  command->callback([&context, options] {
    v1::Edit edit;
    auto& load = *edit.mutable_push_beam_node()->mutable_load();
    load.set_node(options->node);
    if (!options->force.empty()) *load.mutable_force() = vector(options->force);
    if (!options->moment.empty()) *load.mutable_moment() = vector(options->moment);
    print_receipt(context, send(context, options->session, {edit}));
  });
}

void add_gravity(CLI::App& app, Context& context) {
  auto session = std::make_shared<std::string>();
  auto gravity = std::make_shared<std::vector<double>>();
  auto* command = subcommand(app, "gravity", "Gravity of a structure of beams or a rod linkage",
                             "limber gravity arch 0 0 -9.81");
  command->add_option("session", *session, "Session")->required();
  command->add_option("gravity", *gravity, "x y z in m/s^2")->expected(3)->required();
  command->callback([&context, session, gravity] {
    v1::Edit edit;
    *edit.mutable_set_gravity()->mutable_gravity() = vector(*gravity);
    print_receipt(context, send(context, *session, {edit}));
  });
}

}  // namespace

void add_beam_edit_commands(CLI::App& app, Context& context) {
  add_support(app, context);
  add_bring(app, context);
  add_of_node(
      app, context, "release", "Take away what holds a node of a structure of beams",
      [](v1::Edit& edit, unsigned node) { edit.mutable_release_beam_node()->set_node(node); });
  add_of_node(app, context, "hold", "Hold a node of a structure of beams where it is",
              [](v1::Edit& edit, unsigned node) { edit.mutable_hold_beam_node()->set_node(node); });
  add_load(app, context);
  add_push(app, context);
  add_gravity(app, context);
}

}  // namespace limber::cli
