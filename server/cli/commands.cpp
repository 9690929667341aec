#include "server/cli/commands.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "engine/base/checked_number.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "server/cli/config_file.h"
#include "server/cli/serve.h"
#include "server/cli/tools.h"
#include "server/log/log.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

constexpr int kUsage = 2;  // exit code

fs::path default_cache() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/')
    return fs::path(cache) / "limber";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/')
    return fs::path(home) / ".cache" / "limber";
  return {};
}

const char* licence_text() {
  switch (cholesky_library()) {
    case CholeskyLibrary::kCholmodSupernodal:
      return "Sources under the Apache License 2.0. This program links parts of CHOLMOD that are "
             "under "
             "the GPL,\nand so is as a whole under the GNU General Public License, version 3 or "
             "later. NOTICE.md has all libraries.";
    case CholeskyLibrary::kOwnMultifrontal:
      break;
  }
  return "Under the Apache License 2.0 (built without the parts of CHOLMOD that are under the "
         "GPL). "
         "NOTICE.md has\nall libraries.";
}

struct CommandLine {
  ServeOptions serve;
  std::string log_level = "info", log_format = "text";
  fs::path cache = default_cache();
  bool no_cache = false;
  bool allow_shutdown = false;
  fs::path curve_secret, curve_allow;
  web::Options web;  // served with --web
  std::string web_address;
  store::StoreOptions store;  // with --data
  std::string outlives = "power";
  double retain_days = 0;
  int park_after_s = static_cast<int>(ServerOptions{}.park_after.count());
  bool web_beyond_loopback = false, web_deflate = false;
  double drain_s = ServerOptions().drain_s;
  double stalled_after_s = std::chrono::duration<double>(TransportOptions().stalled_after).count();
  bool only_check = false, only_print = false;
};

void add_sockets(CLI::App& app, CommandLine& line) {
  auto& transport = line.serve.server.transport;
  app.add_option("--bind", transport.bind,
                 "Endpoint for requests (ROUTER): tcp://HOST:PORT, PORT 0 for any, or ipc://PATH")
      ->capture_default_str()
      ->group("Sockets");
  app.add_option("--stream", transport.stream, "Endpoint for streams (XPUB)")
      ->capture_default_str()
      ->group("Sockets");
  app.add_option("--ready-file", line.serve.ready_file,
                 "Write the bound endpoints and the pid here, as JSON, once ready")
      ->group("Sockets");
  app.add_option("--stream-queue", transport.stream_queue,
                 "Messages a slow subscriber may have waiting")
      ->capture_default_str()
      ->group("Sockets");
  app.add_option("--stalled-after", line.stalled_after_s,
                 "A follower of streams that reads nothing for so long while messages wait is cut "
                 "off [s]")
      ->capture_default_str()
      ->group("Sockets");
  app.add_option("--curve-secret-file", line.curve_secret,
                 "Secret key (Z85): encrypt, and allow binding beyond loopback")
      ->group("Security");
  app.add_option(
         "--curve-allow", line.curve_allow,
         "Who may connect, a line each: KEY [view, edit or administer [NAME]]; see limber allow. "
         "Read again on SIGHUP")
      ->group("Security");
  app.add_flag("--allow-shutdown", line.allow_shutdown,
               "Clients may stop the server by a request (`limber stop`); else only signals do")
      ->group("Security");
  app.add_option("--mesh-root", line.serve.server.mesh_roots,
                 "Clients may name mesh files below this folder (repeatable)")
      ->allow_extra_args(false)
      ->group("Security");
}

/// A thousand years [days].
constexpr double kMostRetainDays = 365'000;

/// The value that CLI11 gives to an option without one.
constexpr const char* kNoValue = "true";
/// In a file: `web = false`.
constexpr const char* kNotServed = "false";

void add_web(CLI::App& app, CommandLine& line) {
  auto& web = line.web;
  const auto option = [&](const char* name, auto& value, const char* text) {
    return app.add_option(name, value, text)->group("Pages");
  };
  option("--web", line.web_address,
         "Serve pages by HTTP and WebSocket: ADDRESS:PORT, PORT 0 for any (127.0.0.1:8080 unless "
         "given)")
      ->expected(0, 1)
      ->type_name("[ADDRESS:PORT]");
  option("--web-root", web.root, "Serve the files of this folder in place of those compiled in");
  option("--web-token-file", web.token_file,
         "The token that pages must show is in this file (mode 600); else a random one is made");
  option("--web-host", web.hosts,
         "A name by which browsers may reach this server besides its addresses (repeatable)")
      ->allow_extra_args(false);
  option("--web-frame-ancestor", web.frame_ancestors,
         "Pages of this origin may embed ours: http://HOST:PORT, of a notebook (repeatable)")
      ->allow_extra_args(false);
  option("--web-connections", web.connections, "WebSockets at once")->capture_default_str();
  option("--web-queue-bytes", web.queue_bytes, "Stream messages that may wait for one WebSocket")
      ->capture_default_str();
  app.add_flag("--web-deflate", line.web_deflate, "Compress messages where the browser offers it")
      ->group("Pages");
  app.add_flag("--web-beyond-loopback", line.web_beyond_loopback,
               "Other machines may connect. Nothing is encrypted: put a proxy with TLS before it")
      ->group("Pages");
}

/// CLI11 would take -3 for a number near 2^64, and the largest there is for one beyond.
void check_whole_numbers(CLI::App& app) {
  const CLI::Validator is_whole(
      [](std::string& text) {
        return parse_number<std::uint64_t>(text) ? std::string()
                                                 : text + " is not a whole number in [0, 2^64)";
      },
      "", "whole number");
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name().starts_with("UINT")) option->check(is_whole);
  }
}

/// @throws Refusal for an option of pages without --web
std::optional<web::Options> web_options(const CLI::App& app, const CommandLine& line) {
  if (app.count("--web") == 0 || line.web_address == kNotServed) {
    for (const char* name :
         {"--web-root", "--web-token-file", "--web-host", "--web-frame-ancestor",
          "--web-connections", "--web-queue-bytes", "--web-deflate", "--web-beyond-loopback"}) {
      if (app.count(name) > 0) throw invalid(name, "is for a limberd with --web");
    }
    return std::nullopt;
  }
  web::Options web = line.web;
  if (line.web_address != kNoValue) web.address = line.web_address;
  if (line.web_deflate) web.deflate = web::Deflate::kOn;
  if (line.web_beyond_loopback) web.beyond_loopback = web::Beyond::kAllowed;
  return web;
}

void add_limits(CLI::App& app, CommandLine& line) {
  auto& limits = line.serve.server.limits;
  const auto option = [&](const char* name, std::uint64_t& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group("Limits");
  };
  const auto live = [&]<class T>(const char* name, Live<T>& value, const char* text) {
    app.add_option_function<T>(
           name, [&value](const T& given) { value = given; }, text)
        ->default_str(std::to_string(T{value}))
        ->group("Limits");
  };
  option("--max-message-bytes", line.serve.server.transport.message_bytes, "Largest message");
  option("--max-unread-bytes", line.serve.server.transport.unread_bytes,
         "Replies one client may leave unread");
  option("--max-unread-total-bytes", line.serve.server.transport.unread_total_bytes,
         "Replies all clients together may leave unread");
  option("--max-stream-bytes", line.serve.server.transport.stream_bytes,
         "Stream messages that may wait for one follower");
  option("--max-stream-total-bytes", line.serve.server.transport.stream_total_bytes,
         "Stream messages that all together may leave unread, each counted once");
  live("--max-sessions", limits.sessions, "Sessions in memory");
  live("--max-memory-bytes", limits.memory_bytes,
       "Estimated memory of all sessions together; beyond it those that nobody uses are parked. 0: "
       "three quarters of the machine's, at least one session's");
  live("--max-tets", limits.mesh_tets, "Tets of a mesh");
  live("--max-frames", limits.frames, "Frames of a scene");
  live("--max-constraints", limits.constraints, "Constraints of a session");
  live("--max-jobs", limits.jobs, "Jobs running at once, besides openings");
  live("--max-session-bytes", limits.session_bytes, "Estimated memory of one session");
}

/// One of some words, in any case; not listed in the help again.
CLI::Validator one_of(std::vector<std::string> words) {
  return CLI::Validator(CLI::IsMember(std::move(words), CLI::ignore_case)).description("");
}

/// `--data --check-config` has lost its folder.
CLI::Validator not_an_option() {
  return {[](const std::string& text) {
            return text.starts_with("--") ? "'" + text + "' is an option, no folder" : "";
          },
          ""};
}

void add_store(CLI::App& app, CommandLine& line) {
  const auto add = [&](const char* name, auto& value, const char* text) {
    return app.add_option(name, value, text)->group("Store");
  };
  add("--data", line.store.folder,
      "Folder in which sessions are stored: edits are there before they are acknowledged, and "
      "come back after any end of the server. Without it sessions end with the server")
      ->check(not_an_option());
  add("--data-outlives", line.outlives,
      "What acknowledged edits outlive: process (kill -9) or power (synced, some ms for each "
      "group of edits)")
      ->capture_default_str()
      ->transform(one_of({"power", "process"}));
  add("--data-bytes", line.store.bytes,
      "Size of the store's file, at most, without its write-ahead log, which takes some megabytes "
      "beside it; 0: what the disk holds")
      ->capture_default_str()
      ->transform(CLI::AsSizeValue(false));
  add("--checkpoint-edits", line.store.checkpoint_edits,
      "Edits of a session that are stored one by one, about; behind as many, what they have made "
      "of "
      "it is stored in their place; 0: all are")
      ->capture_default_str();
  add("--park-after", line.park_after_s,
      "Seconds after which a stored session that nobody is in or asks for is parked: it takes no "
      "memory, and comes back when somebody asks for it; 0: only when memory is needed")
      ->capture_default_str()
      ->check(CLI::Range(0, 31'536'000));
  add("--retain", line.retain_days,
      "Days after which stored sessions that nobody changes are removed; 0: never")
      ->capture_default_str()
      ->check(CLI::Range(0.0, kMostRetainDays));
}

std::optional<store::StoreOptions> store_options(const CommandLine& line) {
  if (line.store.folder.empty()) return std::nullopt;
  store::StoreOptions options = line.store;
  options.durability =
      line.outlives == "power" ? store::Durability::kPower : store::Durability::kProcess;
  options.retain = std::chrono::seconds(std::llround(line.retain_days * 86400));
  return options;
}

void add_operation(CLI::App& app, CommandLine& line) {
  const auto add = [&](const char* name, auto& value, const char* text) {
    return app.add_option(name, value, text)->capture_default_str()->group("Operation");
  };
  add("--log-level", line.log_level,
      "error, warn, info, debug or off; one line per event on stderr")
      ->transform(one_of({"error", "warn", "info", "debug", "off"}));
  add("--log-format", line.log_format, "text, or json: one object a line, with fields for machines")
      ->transform(one_of({"text", "json"}));
  add("--drain-seconds", line.drain_s,
      "Seconds that SIGTERM leaves for what is under way: edits are acknowledged and stored, new "
      "sessions refused");
  app.set_config("--config", "",
                 "Read options from this file, which are written as `--print-config` prints them")
      ->group("Operation");
  app.add_flag("--check-config", line.only_check,
               "Check the options, say what is wrong, and start nothing")
      ->configurable(false)
      ->group("Operation");
  app.add_flag("--print-config", line.only_print,
               "Print all options with their values as a file for --config")
      ->configurable(false)
      ->group("Operation");
}

void add_server_options(CLI::App& app, CommandLine& line) {
  add_sockets(app, line);
  add_web(app, line);
  add_limits(app, line);
  app.add_option("--threads", line.serve.server.session_threads,
                 "Threads for builds and solves; 0: as many as jobs and cores together")
      ->capture_default_str();
  app.add_option("--request-threads", line.serve.server.request_threads,
                 "Threads for reading meshes, encoding frames and long edits")
      ->capture_default_str();
  add_store(app, line);
  app.add_option("--cache-dir", line.cache, "Folder of built models")->capture_default_str();
  app.add_flag("--no-cache", line.no_cache, "Build every model anew");
  add_operation(app, line);
  check_whole_numbers(app);
}

log::Level level_of(const std::string& word) {
  const std::map<std::string, log::Level> levels{{"error", log::Level::kError},
                                                 {"warn", log::Level::kWarn},
                                                 {"info", log::Level::kInfo},
                                                 {"debug", log::Level::kDebug},
                                                 {"off", log::Level::kOff}};
  return levels.at(word);
}

/// @throws Refusal or Error naming the option
ServeOptions serve_options(const CLI::App& app, CommandLine& line) {
  auto& server = line.serve.server;
  if (!line.no_cache) server.cache_folder = line.cache;
  if (line.allow_shutdown) server.shutdown_requests = ShutdownRequests::kAllowed;
  if (line.curve_secret.empty() != line.curve_allow.empty()) {
    throw invalid("--curve-secret-file", "--curve-secret-file and --curve-allow go together");
  }
  if (!line.curve_secret.empty())
    server.transport.curve = read_curve_setup(line.curve_secret, line.curve_allow);
  server.store = store_options(line);
  server.park_after = std::chrono::seconds(line.park_after_s);
  server.drain_s = line.drain_s;
  if (!(line.stalled_after_s >= 0.001 && line.stalled_after_s <= 86400))
    throw invalid("--stalled-after",
                  fmt::format("{} is not within 0.001 and 86400 s", line.stalled_after_s));
  server.transport.stalled_after =
      std::chrono::milliseconds(std::llround(1000 * line.stalled_after_s));
  line.serve.web = web_options(app, line);
  line.serve.curve_allow = line.curve_allow;
  line.serve.log_level = level_of(line.log_level);
  line.serve.log_format = line.log_format == "json" ? log::Format::kJson : log::Format::kText;
  line.serve.values = ConfigFile::values(app);
  return line.serve;
}

/// `limber validate` becomes limberd under its own name: it is limber that the user called.
std::string program_name(const char* called_as) {
  return fs::path(called_as).filename() == "limber" ? "limber" : "limberd";
}

int report(const std::string& program, const std::exception& fault) {
  const proto::Error error = error_to_proto(fault);
  const bool names_field =
      error.message().starts_with(error.field());  // readers begin with their file
  fmt::print(stderr, "{}: {}{}{}\n", program, names_field ? "" : error.field(),
             names_field ? "" : ": ", error.message());
  return 1;
}

/// The options and commands of limberd, with their given values.
class Front {
 public:
  Front(const std::string& program, const MakeKinds& make_kinds)
      : app_(
            "limberd holds scenes (elastic bodies, rod linkages, beam structures) and keeps their "
            "optimum while clients edit them.\n"
            "Without a command it serves; the protocol is described in docs/protocol.md.",
            program) {
    app_.set_version_flag("--version",
                          fmt::format("limberd {}\n{}", LIMBER_VERSION, licence_text()));
    app_.get_formatter()->column_width(34);
    app_.require_subcommand(0, 1);
    app_.config_formatter(std::make_shared<ConfigFile>(app_));
    add_server_options(app_, line_);
    tools_.add_to(app_, make_kinds);
  }
  /// @throws CLI::ParseError
  void parse(std::vector<std::string> arguments) {
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app_.parse(std::move(arguments));
  }
  [[nodiscard]] CLI::App& app() { return app_; }
  [[nodiscard]] const CommandLine& line() const { return line_; }
  [[nodiscard]] const ToolCommands& tools() const { return tools_; }
  /// @throws Refusal or Error naming the option
  [[nodiscard]] ServeOptions options() { return serve_options(app_, line_); }

 private:
  CLI::App app_;
  CommandLine line_;
  ToolCommands tools_;
};

int check_options(Front& front) {
  try {
    front.options().validate();
  } catch (const std::exception& fault) {
    report(front.app().get_name(), fault);
    return kUsage;
  }
  fmt::print("{}: the options are sound\n", front.app().get_name());
  return 0;
}

}  // namespace

int run(int argc, char** argv, const MakeKinds& make_kinds) {
  google::protobuf::SetLogHandler(nullptr);  // an error in a message is reported to its sender
  const std::string program = program_name(argv[0]);
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  Front front(program, make_kinds);
  try {
    front.parse(arguments);
  } catch (const CLI::ParseError& fault) {
    return front.app().exit(fault) == 0 ? 0 : kUsage;
  }
  if (front.line().only_check) return check_options(front);
  try {
    if (front.line().only_print) {
      fmt::print("{}", front.app().config_to_str());
      return 0;
    }
    log::set_level(level_of(front.line().log_level));
    if (const auto code = front.tools().run()) return *code;
    ServeOptions options = front.options();
    log::set_format(options.log_format);
    options.read_again = [program, arguments, make_kinds] {
      Front again(program, make_kinds);
      again.parse(arguments);
      return again.options();
    };
    return serve(options, make_kinds);
  } catch (const std::exception& fault) {
    return report(program, fault);
  }
}

}  // namespace limber::server
