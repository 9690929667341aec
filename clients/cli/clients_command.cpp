// clients: the clients in a session, and the authors of its newest revisions.

#include <fmt/format.h>

#include <memory>
#include <string>

#include "clients/cli/context.h"
#include "clients/cli/print.h"
#include "clients/cpp/open_session.h"

namespace limber::cli {
namespace {

std::string ago(double seconds) {
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.0f} h", seconds / 3600);
}

std::string revisions(const v1::SessionRevision& made) {
  return made.first() == made.revision() ? std::to_string(made.revision())
                                         : fmt::format("{}-{}", made.first(), made.revision());
}

std::string what(const v1::SessionRevision& made) {
  std::string text;
  for (const std::string& edit : made.edits()) text += (text.empty() ? "" : ", ") + edit;
  return text;
}

void print_clients(Context& context, const std::string& session) {
  const auto status = context.session<client::OpenSession>(session).status();
  if (context.json) {
    v1::JoinSessionResponse answer;  // without a number of its own: this command only looks
    *answer.mutable_clients() = status.clients();
    *answer.mutable_revisions() = status.revisions();
    return print_json(answer);
  }
  if (status.clients().empty()) {
    fmt::print("nobody is in session {}\n", status.session());
  } else {
    Table people({"client", "name", "since", "last revision"});
    for (const auto& one : status.clients())
      people.add({std::to_string(one.client()), one.name(), ago(one.present_s()),
                  one.last_revision() == 0 ? "-" : std::to_string(one.last_revision())});
    fmt::print("{}", people.text());
  }
  Table made({"revision", "by", "what", "ago"});
  for (const auto& one : status.revisions())
    made.add({revisions(one), one.name(), what(one), ago(one.age_s())});
  fmt::print("\n{}", made.text());
}

}  // namespace

void add_clients_command(CLI::App& app, Context& context) {
  auto session = std::make_shared<std::string>();
  auto* command =
      subcommand(app, "clients", "Who is in a session, and who made its newest revisions",
                 "limber clients flower");
  command->add_option("session", *session, "Session")->required();
  command->callback([&context, session] { print_clients(context, *session); });
}

}  // namespace limber::cli
