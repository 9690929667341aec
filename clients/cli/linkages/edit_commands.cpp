// deploy, pin, attach, load --joint: edits of rod linkages.

#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>

#include "clients/cli/linkages/commands.h"
#include "clients/cli/receipt.h"
#include "clients/cpp/linkages/session.h"

namespace limber::cli::linkages {
namespace {

using client::LinkageSession;

void add_linkage_session(CLI::App& command, std::string& session) {
  command.add_option("session", session, "Session of a rod linkage")->required();
}

void add_deploy(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    std::optional<double> angle;
    std::optional<unsigned> joint;
    bool free = false;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "deploy", "Open a rod linkage to a mean angle, or one of its joints",
                 "limber deploy shelter --angle 60\n  limber deploy shelter --joint 4 --free");
  add_linkage_session(*command, options->session);
  auto* angle = command->add_option_group("angle", "Where to");
  angle->add_option("--angle", options->angle, "Opening angle in degrees, between -180 and 180");
  angle->add_flag("--free", options->free, "From now on it may take any");
  angle->require_option(1);
  command->add_option("--joint", options->joint, "Of this joint, from 0 (default: mean of all)");
  command->callback([&context, options] {
    auto session = context.session<LinkageSession>(options->session);
    print_receipt(context, options->joint ? session.set_angle(*options->joint, options->angle)
                                          : session.deploy(options->angle));
  });
}

void add_pin(CLI::App& app, Context& context) {
  static const std::map<std::string, v1::Held> kHeld{{"motion", v1::HELD_MOTION},
                                                     {"angle", v1::HELD_ANGLE},
                                                     {"both", v1::HELD_MOTION_AND_ANGLE},
                                                     {"nothing", v1::HELD_NOTHING}};
  struct Options {
    std::string session, held = "both";
    unsigned joint = 0;
    std::vector<double> position;
  };
  auto options = std::make_shared<Options>();
  auto* command =
      subcommand(app, "pin", "Hold a joint of a rod linkage, or release it",
                 "limber pin shelter 0 --held motion\n  limber pin shelter 0 --held nothing");
  add_linkage_session(*command, options->session);
  command->add_option("joint", options->joint, "Joint, from 0")->required();
  command->add_option("--held", options->held, "motion, angle, both (default) or nothing")
      ->check(CLI::IsMember({"motion", "angle", "both", "nothing"}));
  command->add_option("--position", options->position, "Bring it to this point x y z")->expected(3);
  command->callback([&context, options] {
    std::optional<client::Vector> position;
    if (!options->position.empty()) position = vector(options->position);
    auto session = context.session<LinkageSession>(options->session);
    print_receipt(context, session.pin(options->joint, kHeld.at(options->held), position));
  });
}

void add_attach(CLI::App& app, Context& context) {
  struct Options {
    std::string session;
    std::optional<unsigned> joint, segment;
    std::optional<std::uint64_t> move;
    double share = 0.5, stiffness = LinkageSession::kStiffness;
    std::vector<double> position;
    std::vector<std::uint64_t> remove;
  };
  auto options = std::make_shared<Options>();
  auto* command = subcommand(
      app, "attach", "Pull a point of a rod linkage to a point in space by a spring, or let it go",
      "limber attach shelter --joint 5 --position 0 0 1.2 --stiffness 500\n"
      "  limber attach shelter --move 1 --position 0 0 1.3\n"
      "  limber attach shelter --remove 1");
  add_linkage_session(*command, options->session);
  auto* position = command->add_option("--position", options->position, "x y z")->expected(3);
  auto* at = command->add_option_group("at", "Which point");
  at->add_option("--joint", options->joint, "A joint, from 0")->needs(position);
  auto* segment = at->add_option("--segment", options->segment, "A point of a segment, from 0");
  segment->needs(position);
  at->add_option("--move", options->move, "That of a target there is already")->needs(position);
  auto* remove = at->add_option("--remove", options->remove, "Take these targets away");
  remove->excludes(position);
  at->require_option(1);
  command->add_option("--share", options->share, "Of the segment's length (default: 0.5)")
      ->needs(segment);
  command->add_option("--stiffness", options->stiffness, "Of the spring in N/m (default: 1000)")
      ->excludes(remove);
  command->callback([&context, options] {
    auto session = context.session<LinkageSession>(options->session);
    if (!options->remove.empty())
      return print_receipt(context, session.remove_targets(options->remove));
    const client::Vector point = vector(options->position);
    if (options->move) return print_receipt(context, session.move_target(*options->move, point));
    v1::LinkageTarget target;
    if (options->joint) target.set_joint(*options->joint);
    if (options->segment) {
      target.mutable_segment()->set_segment(*options->segment);
      target.mutable_segment()->set_share(options->share);
    }
    *target.mutable_position() = client::message(point);
    target.set_stiffness(options->stiffness);
    print_receipt(context, session.add_target(target));
  });
}

}  // namespace

void add_edit_commands(CLI::App& app, Context& context) {
  add_deploy(app, context);
  add_pin(app, context);
  add_attach(app, context);
}

v1::EditResponse load_joint(Context& context, const LoadOptions& options) {
  const client::JointLoad load{vector(options.force), vector(options.moment), options.torque};
  return context.session<LinkageSession>(options.session).load(*options.joint, load);
}

}  // namespace limber::cli::linkages
