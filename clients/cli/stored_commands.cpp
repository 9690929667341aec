// sessions: those that a server keeps in its folder.

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "clients/cli/kinds.h"
#include "clients/cli/limberd.h"
#include "clients/cli/print.h"
#include "clients/cpp/error.h"
#include "clients/cpp/files.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

void list_stored(Context& context) {
  const auto sessions = client::list_sessions(context.client());
  if (context.json) return print_json(sessions);
  Table table({"session", "kind", "state", "revision", "stored"});
  for (const auto& one : sessions.sessions())
    table.add({one.session(), one.kind(), state_words(one), std::to_string(one.revision()),
               one.is_stored() ? "yes" : "no"});
  fmt::print("{}", table.text());
  const auto info = client::server_info(context.client());
  if (!info.has_store()) {
    fmt::print("\nThey end with the server: start limberd with --data FOLDER to keep them.\n");
    return;
  }
  const auto& store = info.store();
  fmt::print("\n{} stored, {} of them parked; {:.1f} MB; {} in {} since the start\n",
             store.sessions(), store.parked(), static_cast<double>(store.bytes()) * 1e-6,
             counted(store.changes(), "change"), counted(store.commits(), "commit"));
  if (!store.warning().empty()) fmt::print("warning: {}\n", store.warning());
  if (!store.fault().empty()) {
    fmt::print("NOTHING CAN BE STORED NOW: {}\n", store.fault());
    context.exit_code = kRefused;
  }
}

void export_session(Context& context, const std::string& session, const std::string& file) {
  const auto saved = client::save_session(context.client(), session);
  client::write_bytes(file, saved.content());
  if (!context.json) fmt::print("{}: {} bytes\n", file, saved.content().size());
}

void import_session(Context& context, const std::string& file, const std::string& name) {
  const auto restored =
      client::restore_session(context.client(), client::read_bytes(file, "file"), name);
  if (context.json) return print_json(restored);
  fmt::print("session {} ({}), revision {}\n", restored.session(), restored.kind(),
             restored.revision());
}

/// One that is not there leaves the others to be removed.
void remove(Context& context, const std::vector<std::string>& sessions) {
  for (const std::string& session : sessions) {
    v1::CloseSessionRequest request;
    request.set_session(session);
    try {
      (void)context.client().call(request);
      if (!context.json) fmt::print("{} is removed\n", session);
    } catch (const client::ClientError& error) {
      if (error.code() != v1::ERROR_CODE_NOT_FOUND) throw;
      print_error(context, error);
      context.exit_code = kRefused;
    }
  }
}

void add_backup_command(CLI::App& app, Context& context) {
  struct Line {
    std::string folder, file;
    bool replaces = false;
  };
  auto line = std::make_shared<Line>();
  auto* command = subcommand(
      app, "backup",
      "Copy the store of a folder into one file, also while a server has the folder (needs no "
      "server)",
      "limber backup /var/lib/limber sessions-monday.sqlite");
  command->add_option("folder", line->folder, "Folder of `limberd --data`")->required();
  command->add_option("file", line->file, "Copy to make; it gets this name once it is whole")
      ->required();
  command->add_flag("--replace", line->replaces, "FILE may be there, and is replaced");
  command->callback([line, &context] {
    std::vector<std::string> arguments = {"backup"};
    if (line->replaces) arguments.emplace_back("--replace");
    if (context.json) arguments.emplace_back("--json");
    arguments.insert(arguments.end(), {"--", line->folder, line->file});
    become_limberd(arguments);
  });
}

}  // namespace

void add_stored_commands(CLI::App& app, Context& context) {
  add_backup_command(app, context);
  auto* all = subcommand(app, "sessions",
                         "Sessions and whether the server keeps them; export, import, remove",
                         "limber sessions export flower flower.limber");
  all->require_subcommand(0, 1);
  all->callback([&context, all] {
    if (all->get_subcommands().empty()) list_stored(context);
  });

  auto session = std::make_shared<std::string>();
  auto file = std::make_shared<std::string>();
  auto* command = subcommand(*all, "export", "A stored session with its edits, into one file",
                             "limber sessions export flower flower.limber");
  command->add_option("session", *session, "Session")->required();
  command->add_option("file", *file, "File to write")->required();
  command->callback([&context, session, file] { export_session(context, *session, *file); });

  auto name = std::make_shared<std::string>();
  command = subcommand(*all, "import", "A session from such a file",
                       "limber sessions import flower.limber --as tulip");
  command->add_option("file", *file, "File to read")->required();
  command->add_option("--as", *name, "Name of the session (default: the one that it had)");
  command->callback([&context, file, name] { import_session(context, *file, *name); });

  auto sessions = std::make_shared<std::vector<std::string>>();
  command = subcommand(*all, "remove", "Sessions for good, parked ones too",
                       "limber sessions remove flower tulip");
  command->add_option("sessions", *sessions, "Sessions")->required();
  command->callback([&context, sessions] { remove(context, *sessions); });
}

}  // namespace limber::cli
