// record, replay: messages between clients and a server, and whether they repeat. Done by the
// Python client.

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "clients/cli/python.h"

namespace limber::cli {

void add_recording_commands(CLI::App& app, Context& context) {
  struct Line {
    std::string file, bind = "tcp://127.0.0.1:*";
    double tolerance = 1e-3;
  };
  auto line = std::make_shared<Line>();
  auto* record = subcommand(app, "record",
                            "Record what clients and the server say to each other: prints an "
                            "endpoint for the clients, and "
                            "ends with Ctrl-C. Needs the Python client",
                            "limber record FILE.limberrec");
  record->add_option("file", line->file)->required();
  record->add_option("--bind", line->bind, "Endpoint for the clients")->capture_default_str();
  record->callback([&context, line] {
    demand_no_keys(context, "record");
    run_python(context, "record", {line->file, "--bind", line->bind});
  });
  auto* replay =
      subcommand(app, "replay",
                 "Send the requests of a recording again; prints how the replies differ, and exits "
                 "with 1 where they do. Needs the Python client",
                 "limber replay FILE.limberrec");
  replay->add_option("file", line->file)->required();
  replay->add_option("--tolerance", line->tolerance, "Of energies, as a share")
      ->capture_default_str();
  replay->callback([&context, line] {
    demand_no_keys(context, "replay");
    run_python(context, "replay", {line->file, "--tolerance", fmt::format("{}", line->tolerance)});
  });
}

}  // namespace limber::cli
