// list, show, explain, wait, close, cancel: sessions of every kind.

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "clients/cli/context.h"
#include "clients/cli/kinds.h"
#include "clients/cli/print.h"
#include "clients/cpp/open_session.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

using client::ClientError;
using client::OpenSession;

void list(Context& context) {
  const auto response = client::list_sessions(context.client());
  if (context.json) return print_json(response);
  Table table({"session", "name", "state", "size", "conditions", "revision", "solved", "energy",
               "mean angle [deg]"});
  for (const auto& s : response.sessions()) {
    const Kind& kind = kind_of(s);
    const std::string solved = s.has_result() ? fmt::format("{}{}", s.result().revision(),
                                                            s.result().converged() ? "" : "+")
                                              : "-";
    const std::string unit = kind.energy_unit().empty() ? "" : " " + kind.energy_unit();
    const std::string energy =
        !s.has_result() || (s.result().solve_failed() && s.result().total_energy() == 0)
            ? "-"
            : fmt::format("{:.4g}{}", s.result().total_energy(), unit);
    table.add({s.session(), s.name(), state_words(s), kind.listed_sizes(s),
               kind.listed_conditions(s), std::to_string(s.revision()), solved, energy,
               kind.listed_angle(s)});
  }
  fmt::print("{}", table.text());
}

void show(Context& context, const std::string& session) {
  const auto response = context.session<OpenSession>(session).status_and_scene();
  if (context.json) return print_json(response);
  const Kind& kind = kind_of(response.status());
  fmt::print("{}", kind.summary(response));
  if (response.status().has_result())
    fmt::print("\n{}", describe(kind, response.status().result()));
  const std::string conditions = kind.conditions(response);
  if (!conditions.empty()) fmt::print("\n{}", conditions);
}

std::string in_words(const v1::ExpectedError& error) {
  if (!error.has_value()) return "not known";
  return error.unit().empty() ? fmt::format("{:.3g} %", 100 * error.value())
                              : fmt::format("{:.3g} {}", error.value(), error.unit());
}

void explain(Context& context, const std::string& session) {
  const auto response = context.session<OpenSession>(session).explain();
  if (context.json) return print_json(response);
  fmt::print("What was chosen\n");
  for (const v1::ModelChoice& choice : response.choices()) {
    fmt::print("  {}: {}{}\n      {}\n", choice.name(), choice.value(),
               choice.asked_for() ? " (asked for)" : "", choice.reason());
    if (!choice.cost().empty()) fmt::print("      cost: {}\n", choice.cost());
  }
  fmt::print("\nWhich error to expect (revision {})\n", response.revision());
  for (const v1::ExpectedError& error : response.errors()) {
    fmt::print(
        "  {}: {}{}\n      {}\n", error.quantity(), in_words(error),
        error.has_tolerance() ? fmt::format(" (asked for: {:.3g} %)", 100 * error.tolerance()) : "",
        error.method());
  }
  if (response.advice().empty()) return;
  fmt::print("\nWhat would change that\n");
  for (const v1::Advice& advice : response.advice())
    fmt::print("  {}: {}\n", advice.goal(), advice.change());
}

struct WaitLine {
  std::string session;
  std::string until = "final";
  std::optional<std::uint64_t> revision;
  double wait_s = 60;
};

void show_progress(const v1::SessionStatus& status, std::uint64_t wanted, ProgressBar& bar) {
  if (status.state() == v1::SESSION_STATE_BUILDING)
    bar.show(status.progress().stage(), status.progress().fraction());
  else if (status.revision() < wanted)
    bar.show(fmt::format("no revision {} yet, the newest is {}", wanted, status.revision()));
  else
    bar.show(fmt::format("solving, revision {}", status.revision()));
}

/// Looks at the session in between; a result that is there soon shows nothing.
v1::ResultInfo wait_with_progress(OpenSession& session, std::uint64_t revision,
                                  const WaitLine& line) {
  ProgressBar bar;
  std::uint64_t newest = revision;
  client::WaitOptions options;
  options.revision = revision;
  options.until = wait_until(line.until);
  options.timeout = milliseconds(line.wait_s);
  options.progress = [&](const v1::SessionStatus& status) {
    newest = status.revision();
    show_progress(status, revision, bar);
  };
  try {
    return session.wait(options);
  } catch (const client::Unreachable&) {
    throw;
  } catch (const ClientError& error) {
    if (error.code() != v1::ERROR_CODE_TIMEOUT) throw;
  }
  throw ClientError(
      v1::ERROR_CODE_TIMEOUT, "",
      newest < revision
          ? fmt::format("there is no revision {} yet, the newest is {}; waited {:g} s for it",
                        revision, newest, line.wait_s)
          : fmt::format("no such result within {:g} s", line.wait_s));
}

void wait(Context& context, const WaitLine& line) {
  auto session = context.session<OpenSession>(line.session);
  const v1::SessionStatus status = session.status();
  const std::uint64_t revision = line.revision.value_or(status.revision());
  const auto result = wait_with_progress(session, revision, line);
  note_failure(context, result);
  if (context.json) return print_json(result);
  fmt::print("{}", describe(kind_of(status), result));
}

/// A subcommand that takes a session and does one thing to it.
template <class Act>
void add_act(CLI::App& app, const std::string& name, const std::string& description,
             const Act& act) {
  auto session = std::make_shared<std::string>();
  auto* command = subcommand(app, name, description, "limber " + name + " flower");
  command->add_option("session", *session, "Session")->required();
  command->callback([session, act] { act(*session); });
}

}  // namespace

void add_session_commands(CLI::App& app, Context& context) {
  auto* command = subcommand(app, "list", "Sessions of the server", "limber list");
  command->callback([&context] { list(context); });

  add_act(app, "show", "A session: state, model, newest result, constraints",
          [&context](const std::string& session) { show(context, session); });

  add_act(
      app, "explain",
      "What was chosen for a session and why, which error to expect, and what would change that",
      [&context](const std::string& session) { explain(context, session); });

  auto options = std::make_shared<WaitLine>();
  command = subcommand(app, "wait", "Wait for a result that contains a revision, and print it",
                       "limber wait flower --revision 3 --until first");
  command->add_option("session", options->session, "Session")->required();
  command->add_option("--revision", options->revision, "Revision (default: the newest)");
  command
      ->add_option("--until", options->until,
                   "first: any result that contains it; final: the last one of it; checked: that, "
                   "of a body with the error of its motion")
      ->check(CLI::IsMember({"first", "final", "checked"}))
      ->capture_default_str();
  command->add_option("--wait", options->wait_s, "Seconds to wait; exit code 4 after that")
      ->check(seconds_in(0.001, 1e6))
      ->capture_default_str();
  command->callback([&context, options] { wait(context, *options); });

  add_act(app, "close", "End a session, for every client", [&context](const std::string& session) {
    const auto response = context.session<OpenSession>(session).close();
    if (context.json) return print_json(response);
    fmt::print("session {} is closed\n", session);
  });

  add_act(app, "cancel", "Stop a running build or solve; the newest result stays",
          [&context](const std::string& session) {
            const auto response = context.session<OpenSession>(session).cancel();
            if (context.json) return print_json(response);
            fmt::print("cancelled\n");
          });
}

}  // namespace limber::cli
