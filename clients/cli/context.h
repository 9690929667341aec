#pragma once

#include <google/protobuf/message.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "clients/cpp/client.h"
#include "clients/cpp/error.h"
#include "clients/cpp/session_reference.h"

namespace limber::cli {

/// Exit codes, documented in `limber --help` and docs/guide.md.
enum ExitCode {
  kDone = 0,
  kRefused = 1,        // an error with code and field on stderr; a scene that is not valid
  kUsage = 2,          // the command line
  kUnreachable = 3,    // no server answers
  kTimeOut = 4,        // a wait ran out of time
  kInterrupted = 130,  // Ctrl-C
};

/// State shared by all subcommands: where the server is, how to print.
class Context {
 public:
  std::string endpoint;
  std::string client_name;  // shown to others in a session; empty: limber-USER@HOST
  bool json = false;
  double timeout_s = 10;
  double connect_timeout_s = 2;      // to find out whether a server is there
  std::string server_key, key_file;  // CURVE; both or none
  int exit_code = kDone;

  /// The client, made at the first request.
  [[nodiscard]] client::Client& client();
  [[nodiscard]] client::ClientOptions client_options() const;
  /// Options of a client that ends running work: it ignores Ctrl-C, and does not wait for long.
  [[nodiscard]] client::ClientOptions closing_options() const;
  /// A session of one kind, or of any (OpenSession). Requests name it as it is given: a command
  /// makes one or two.
  template <class Session>
  [[nodiscard]] Session session(const std::string& name) {
    return {client(), name, client::Naming::kAsGiven};
  }

 private:
  std::unique_ptr<client::Client> client_;
};

/// A message as one line of JSON, field names as in the .proto, absent numbers as 0.
[[nodiscard]] std::string to_json(const google::protobuf::Message& message);
void print_json(const google::protobuf::Message& message);
/// On stderr: a line of JSON with --json.
void print_error(const Context& context, const client::ClientError& error);

/// Ctrl-C from now on sets a flag instead of ending the process; the second one ends it.
void catch_interrupts();
[[nodiscard]] bool interrupted();

/// While one exists, Ctrl-C is remembered but ends no wait; a second one ends the process.
class DeferInterrupts {
 public:
  DeferInterrupts();
  ~DeferInterrupts();
  DeferInterrupts(const DeferInterrupts&) = delete;
  DeferInterrupts& operator=(const DeferInterrupts&) = delete;
};

/// The folder this program lies in.
[[nodiscard]] std::string own_folder();
/// The limberd in the folder of this program, else on PATH. @throws ClientError NOT_FOUND
[[nodiscard]] std::string find_limberd();

/// Refuses values that are no time within [least, most] seconds. CLI::Range lets NaN through.
[[nodiscard]] CLI::Validator seconds_in(double least, double most);
/// Seconds as the client library wants them.
[[nodiscard]] client::Milliseconds milliseconds(double seconds);

void add_server_commands(CLI::App& app, Context& context);
void add_status_command(CLI::App& app, Context& context);
void add_stored_commands(CLI::App& app, Context& context);
void add_access_commands(CLI::App& app, Context& context);
void add_web_command(CLI::App& app, Context& context);
void add_scene_commands(CLI::App& app, Context& context);
void add_open_command(CLI::App& app, Context& context);
void add_session_commands(CLI::App& app, Context& context);
void add_clients_command(CLI::App& app, Context& context);
void add_history_commands(CLI::App& app, Context& context);
void add_script_command(CLI::App& app, Context& context);
void add_gravity_command(CLI::App& app, Context& context);
void add_result_commands(CLI::App& app, Context& context);
void add_render_command(CLI::App& app, Context& context);
void add_recording_commands(CLI::App& app, Context& context);

/// A subcommand with an example below its help.
CLI::App* subcommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& example);

}  // namespace limber::cli
