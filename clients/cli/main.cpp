// limber: drives limberd from a terminal or a shell script.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "clients/cli/arguments.h"
#include "clients/cli/beams/commands.h"
#include "clients/cli/bodies/commands.h"
#include "clients/cli/context.h"
#include "clients/cli/linkages/commands.h"
#include "clients/cli/load_command.h"

namespace {

using limber::cli::Context;

int report(const Context& context, const limber::client::ClientError& error) {
  namespace cli = limber::cli;
  cli::print_error(context, error);
  if (cli::interrupted()) return cli::kInterrupted;
  if (dynamic_cast<const limber::client::Unreachable*>(&error) != nullptr) return cli::kUnreachable;
  return error.code() == limber::v1::ERROR_CODE_TIMEOUT ? cli::kTimeOut : cli::kRefused;
}

int usage(const CLI::App& app, const CLI::ParseError& error) {
  const auto unknown = app.remaining();
  if (app.get_subcommands().empty() && !unknown.empty()) {
    fmt::print(stderr, "limber: there is no command '{}'; `limber --help` lists them\n",
               unknown.front());
    return limber::cli::kUsage;
  }
  // A misspelt option is why another seems to be missing.
  const auto all = app.remaining(true);
  const auto option = std::find_if(all.begin(), all.end(), [](const std::string& word) {
    return word.size() > 1 && word.starts_with('-');
  });
  if (error.get_name() == "RequiredError" && option != all.end()) {
    const auto commands = app.get_subcommands();
    fmt::print(stderr, "limber: there is no option {}; `limber {}--help` lists them\n", *option,
               commands.empty() ? "" : commands.front()->get_name() + " ");
    return limber::cli::kUsage;
  }
  return app.exit(error) == 0 ? limber::cli::kDone : limber::cli::kUsage;
}

void add_commands(CLI::App& app, Context& context) {
  namespace cli = limber::cli;
  cli::add_server_commands(app, context);
  cli::add_status_command(app, context);
  cli::add_stored_commands(app, context);
  cli::add_access_commands(app, context);
  cli::add_web_command(app, context);
  cli::add_scene_commands(app, context);
  cli::add_open_command(app, context);
  cli::add_session_commands(app, context);
  cli::add_clients_command(app, context);
  cli::bodies::add_edit_commands(app, context);
  cli::add_history_commands(app, context);
  cli::add_script_command(app, context);
  cli::bodies::add_keyframe_commands(app, context);
  cli::linkages::add_edit_commands(app, context);
  cli::linkages::add_design_commands(app, context);
  cli::beams::add_solve_command(app, context);
  cli::beams::add_edit_commands(app, context);
  cli::add_load_command(
      app, context, {cli::beams::load_node, cli::beams::load_element, cli::linkages::load_joint});
  cli::add_gravity_command(app, context);
  cli::add_result_commands(app, context);
  cli::add_render_command(app, context);
  cli::add_recording_commands(app, context);
}

int run(int argc, char** argv) {
  namespace cli = limber::cli;
  Context context;
  CLI::App app{
      "limber drives limberd: it opens scenes (elastic bodies, rod linkages, beams), edits their "
      "motion "
      "or "
      "shape by\n"
      "constraints, and fetches the frames. `limber COMMAND --help` explains each command."};
  app.name("limber");
  app.set_version_flag("--version",
                       std::string("limber ") + LIMBER_VERSION + "\nUnder the Apache License 2.0.");
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(
      "\nTo begin:\n"
      "  limber start                                     a server in the background\n"
      "  limber open --sample beam --session b\n"
      "  limber add b --node 1336 --frame 75 --displacement 0 0.1 0\n"
      "  limber wait b && limber export b --format pvd --out motion\n"
      "\nExit codes: 0 done, 1 refused, not valid, not readable or without a solution (why on "
      "stderr),\n"
      "2 wrong command line, 3 no server answers, 4 a wait ran out of time, 130 interrupted by "
      "Ctrl-C.");
  context.endpoint = limber::client::kDefaultEndpoint;
  app.add_option("--endpoint", context.endpoint, "Where limberd answers requests")
      ->envname("LIMBER_ENDPOINT")
      ->capture_default_str();
  app.add_option("--timeout", context.timeout_s, "Seconds to wait for an answer")
      ->check(cli::seconds_in(0.001, 1e6))
      ->capture_default_str();
  app.add_option("--connect-timeout", context.connect_timeout_s,
                 "Seconds to find out whether a server is there")
      ->check(cli::seconds_in(0.001, 1e6))
      ->capture_default_str();
  app.add_flag("--json", context.json,
               "Print JSON, one object a line (64-bit numbers as strings), for scripts");
  app.add_option("--name", context.client_name,
                 "What others in a session see this program as (default: limber-USER@HOST)")
      ->envname("LIMBER_NAME")
      ->check(CLI::Validator(
          [](const std::string& name) {
            return name.size() > 64 ? std::string("a name has at most 64 bytes") : std::string();
          },
          "TEXT"));
  app.add_option("--server-key", context.server_key,
                 "CURVE: public key of the server, or the file that holds it")
      ->envname("LIMBER_SERVER_KEY");
  app.add_option("--key", context.key_file,
                 "CURVE: file of this client's secret key, with FILE.pub beside it")
      ->envname("LIMBER_KEY");
  add_commands(app, context);
  try {
    cli::catch_interrupts();
    auto arguments = cli::as_meant({argv + 1, argv + argc});
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app.parse(std::move(arguments));
    return context.exit_code;
  } catch (const CLI::ParseError& error) {
    return usage(app, error);
  } catch (const limber::client::ClientError& error) {
    return report(context, error);
  } catch (const std::exception& error) {
    fmt::print(stderr, "limber: {}\n", error.what());
    return cli::kRefused;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (...) {  // even an exception from the report of an error
    std::fputs("limber: it cannot say what went wrong\n", stderr);
    return limber::cli::kRefused;
  }
}
