// gravity, undo, redo, edit-script: edits of sessions of several kinds.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include "clients/cli/context.h"
#include "clients/cli/kinds.h"
#include "clients/cli/print.h"
#include "clients/cli/receipt.h"
#include "proto/json_text.h"

namespace limber::cli {
namespace {

using client::ClientError;
using client::OpenSession;

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
v1::EditResponse send_line(OpenSession& session, const v1::EditRequest& request, int number) {
  const std::optional<std::uint64_t> expected =
      request.has_expected_revision() ? std::optional(request.expected_revision()) : std::nullopt;
  try {
    return session.edit({request.edits().begin(), request.edits().end()}, expected);
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
    // A folder can be opened and has no lines.
    if (!file || std::filesystem::is_directory(options.file))
      throw ClientError(v1::ERROR_CODE_IO, "file", "cannot read " + options.file);
  }
  std::istream& in = options.file == "-" ? std::cin : file;
  const Kind* kind = nullptr;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos || line[start] == '#') continue;
    const v1::EditRequest request = parse_line(line, number);
    auto session = context.session<OpenSession>(options.session);
    const auto response = send_line(session, request, number);
    print_receipt(context, response);
    if (options.wait == "none") continue;
    if (kind == nullptr) kind = &kind_of(session.status());
    client::WaitOptions wait;
    wait.revision = response.revision();
    wait.until = wait_until(options.wait);
    const auto result = session.wait(wait);
    if (context.json)
      print_json(result);
    else
      fmt::print("  {}, energy {:.6g}, constraint error {:.3g}, {:.2f} ms{}\n",
                 status_words(result), result.total_energy(), result.max_constraint_error(),
                 result.since_edit_ms(), kind->remark(result));
    note_failure(context, result);
  }
}

}  // namespace

void add_history_commands(CLI::App& app, Context& context) {
  for (const bool undo : {true, false}) {
    const std::string name = undo ? "undo" : "redo";
    auto session = std::make_shared<std::string>();
    auto* command = subcommand(app, name,
                               undo ? "Take back the newest edit made under your name (--name)"
                                    : "Bring back what undo took",
                               "limber " + name + " flower");
    command->add_option("session", *session, "Session")->required();
    auto anyone = std::make_shared<bool>(false);
    command->add_flag("--anyone", *anyone, "The newest edit, whoever made it");
    command->callback([&context, session, undo, anyone] {
      auto of = context.session<OpenSession>(*session);
      const auto whose = *anyone ? OpenSession::Whose::kAnyone : OpenSession::Whose::kOwn;
      print_receipt(context, undo ? of.undo(whose) : of.redo(whose));
    });
  }
}

void add_script_command(CLI::App& app, Context& context) {
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

void add_gravity_command(CLI::App& app, Context& context) {
  auto session = std::make_shared<std::string>();
  auto gravity = std::make_shared<std::vector<double>>();
  auto* command = subcommand(app, "gravity", "Gravity of a structure of beams or a rod linkage",
                             "limber gravity arch 0 0 -9.81");
  command->add_option("session", *session, "Session")->required();
  command->add_option("gravity", *gravity, "x y z in m/s^2")->expected(3)->required();
  command->callback([&context, session, gravity] {
    print_receipt(context, context.session<OpenSession>(*session).gravity(vector(*gravity)));
  });
}

}  // namespace limber::cli
