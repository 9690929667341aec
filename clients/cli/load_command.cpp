// load: of nodes and elements of beams, and of joints of rod linkages.

#include "clients/cli/load_command.h"

#include <memory>

#include "clients/cli/receipt.h"

namespace limber::cli {

void add_load_command(CLI::App& app, Context& context, const LoadsOfKinds& loads) {
  auto options = std::make_shared<LoadOptions>();
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
  command->callback([&context, options, loads] {
    const SendLoad send = options->joint     ? loads.joint
                          : options->element ? loads.element
                                             : loads.node;
    print_receipt(context, send(context, *options));
  });
}

}  // namespace limber::cli
