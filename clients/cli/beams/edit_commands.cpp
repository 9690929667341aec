// support, bring, release, hold, push, load --node, load --element: edits of structures of beams.

#include <fmt/format.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "clients/cli/beams/commands.h"
#include "clients/cli/receipt.h"
#include "clients/cpp/beams/session.h"

namespace limber::cli::beams {
namespace {

using client::BeamSession;
using client::Vector;

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

/// The directions in the six numbers of --axes.
std::array<Vector, 2> two_directions(const std::vector<double>& axes) {
  return {vector({axes.begin(), axes.begin() + 3}), vector({axes.begin() + 3, axes.end()})};
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
    v1::BeamSupport support;
    support.set_node(options->node);
    support.set_fix_x(has(options->translations, 'x'));
    support.set_fix_y(has(options->translations, 'y'));
    support.set_fix_z(has(options->translations, 'z'));
    support.set_fix_rotation_x(has(options->rotations, 'x'));
    support.set_fix_rotation_y(has(options->rotations, 'y'));
    support.set_fix_rotation_z(has(options->rotations, 'z'));
    if (!options->axes.empty()) {
      const auto [x, y] = two_directions(options->axes);
      *support.mutable_x_axis() = client::message(x);
      *support.mutable_y_axis() = client::message(y);
    }
    print_receipt(context, context.session<BeamSession>(options->session).support(support));
  });
}

void add_bring(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    unsigned node = 0;
    client::BeamMove move;
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
  auto* direction = command->add_option_group("direction", "Where to");
  auto* x = direction->add_option("--x", options->move.x, "From where it is drawn, in m");
  auto* y = direction->add_option("--y", options->move.y, "The same along y");
  auto* z = direction->add_option("--z", options->move.z, "The same along z");
  direction->add_option("--position", options->position, "To this point x y z")
      ->expected(3)
      ->excludes(x)
      ->excludes(y)
      ->excludes(z);
  auto* rotation = direction
                       ->add_option("--rotation", options->rotation,
                                    "To this rotation vector from rest, in radian")
                       ->expected(3);
  direction
      ->add_option("--rotation-x", options->move.rotation_x,
                   "About this axis alone, in radian; the others stay as they are")
      ->excludes(rotation);
  direction->add_option("--rotation-y", options->move.rotation_y, "The same about y")
      ->excludes(rotation);
  direction->add_option("--rotation-z", options->move.rotation_z, "The same about z")
      ->excludes(rotation);
  direction->require_option(1, 6);
  add_axes(*command, options->axes);
  command->callback([&context, options] {
    client::BeamMove& move = options->move;
    if (!options->position.empty()) move.position = vector(options->position);
    if (!options->rotation.empty()) move.rotation = vector(options->rotation);
    if (!options->axes.empty()) move.axes = two_directions(options->axes);
    auto session = context.session<BeamSession>(options->session);
    print_receipt(context, session.move_support(options->node, move));
  });
}

/// A command that takes a node and nothing else.
void add_of_node(CLI::App& app, Context& context, const char* name, const char* description,
                 v1::EditResponse (BeamSession::*edit)(unsigned)) {
  auto session = std::make_shared<std::string>();
  auto node = std::make_shared<unsigned>(0);
  auto* command = subcommand(app, name, description, fmt::format("limber {} arch 40", name));
  add_beam_session(*command, *session);
  command->add_option("node", *node, "Node, from 0")->required();
  command->callback([&context, session, node, edit] {
    print_receipt(context, (context.session<BeamSession>(*session).*edit)(*node));
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
    auto session = context.session<BeamSession>(options->session);
    print_receipt(context,
                  session.push(options->node, vector(options->force), vector(options->moment)));
  });
}

client::LoadDirection direction_of(const LoadOptions& options) {
  return options.follows ? client::LoadDirection::kFollows : client::LoadDirection::kFixed;
}

}  // namespace

void add_edit_commands(CLI::App& app, Context& context) {
  add_support(app, context);
  add_bring(app, context);
  add_of_node(app, context, "release", "Take away what holds a node of a structure of beams",
              &BeamSession::release);
  add_of_node(app, context, "hold", "Hold a node of a structure of beams where it is",
              &BeamSession::hold);
  add_push(app, context);
}

v1::EditResponse load_node(Context& context, const LoadOptions& options) {
  return context.session<BeamSession>(options.session)
      .load(*options.node, vector(options.force), vector(options.moment), direction_of(options));
}

v1::EditResponse load_element(Context& context, const LoadOptions& options) {
  return context.session<BeamSession>(options.session)
      .element_load(*options.element, vector(options.force), direction_of(options));
}

}  // namespace limber::cli::beams
