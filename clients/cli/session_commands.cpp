// list, show, wait, close, cancel, cold: sessions.

#include <fmt/format.h>

#include <algorithm>

#include "clients/cli/context.h"
#include "clients/cli/print.h"

namespace limber::cli {
namespace {

using client::Milliseconds;

void list(Context& context) {
  const auto response = context.client().call(v1::ListSessionsRequest{});
  if (context.json) return print_json(response);
  Table table({"session", "name", "state", "size", "conditions", "revision", "solved", "energy",
               "mean angle [deg]"});
  for (const auto& s : response.sessions()) {
    const std::string solved = s.has_result() ? fmt::format("{}{}", s.result().revision(),
                                                            s.result().converged() ? "" : "+")
                                              : "-";
    const bool linkage = s.segments() > 0, beams = s.beam_nodes() > 0;
    const bool body = !linkage && !beams && !is_foreign(s);
    // That of a body has no unit.
    const std::string energy =
        !s.has_result() || (s.result().solve_failed() && s.result().total_energy() == 0)
            ? "-"
            : fmt::format("{:.4g}{}", s.result().total_energy(), linkage || beams ? " J" : "");
    const std::string angle = s.result().has_linkage()
                                  ? fmt::format("{:.2f}", s.result().linkage().mean_angle_degrees())
                                  : "-";
    table.add({s.session(), s.name(), state_words(s),
               body ? fmt::format("{} tets, {} frames", s.tets(), s.frames()) : sizes(s),
               linkage ? fmt::format("{} targets", s.targets())
               : body  ? fmt::format("{} constraints", s.constraints())
                       : "-",
               std::to_string(s.revision()), solved, energy, angle});
  }
  fmt::print("{}", table.text());
}

void show_linkage(const v1::SessionStatus& status) {
  fmt::print("session {}, {}{}{}\n{}, {} targets, revision {}\n", title(status),
             state_words(status), status.message().empty() ? "" : ": ", status.message(),
             sizes(status), status.targets(), status.revision());
  if (status.has_result()) fmt::print("\n{}", describe(status.result()));
}

/// What holds a structure of beams, and what loads it.
void show_beams(const v1::GetSessionResponse& response) {
  const auto& status = response.status();
  const auto& structure = response.scene().beams().structure();
  fmt::print("session {}, {}{}{}\n{}, {} supports, {} motions, {} loads, revision {}\n",
             title(status), state_words(status), status.message().empty() ? "" : ": ",
             status.message(), sizes(status), structure.supports_size(), structure.motions_size(),
             structure.loads_size() + structure.distributed_loads_size(), status.revision());
  if (status.has_result()) fmt::print("\n{}", describe(status.result()));
}

void show(Context& context, const std::string& session) {
  v1::GetSessionRequest request;
  request.set_session(session);
  request.set_with_scene(true);
  const auto response = context.client().call(request);
  if (context.json) return print_json(response);
  const auto& status = response.status();
  if (status.segments() > 0) return show_linkage(status);
  if (status.beam_nodes() > 0) return show_beams(response);
  if (is_foreign(status)) {
    fmt::print("session {}, {}{}{}\n{}, revision {}\n", title(status), state_words(status),
               status.message().empty() ? "" : ": ", status.message(), sizes(status),
               status.revision());
    if (status.has_result()) fmt::print("\n{}", describe(status.result()));
    return;
  }
  fmt::print("session {}, {}{}{}\n{} nodes, {} tets, {} frames, {} constraints, revision {}\n",
             title(status), state_words(status), status.message().empty() ? "" : ": ",
             status.message(), status.nodes(), status.tets(), status.frames(), status.constraints(),
             status.revision());
  if (status.state() == v1::SESSION_STATE_BUILDING)
    fmt::print("{}: {:.0f} %\n", status.progress().stage(), 100 * status.progress().fraction());
  if (status.has_model()) fmt::print("model: {}\n", describe(status.model()));
  fmt::print("ends: {} / {}\n",
             words(v1::EndCondition_Name(response.scene().first_end()), "END_CONDITION_"),
             words(v1::EndCondition_Name(response.scene().last_end()), "END_CONDITION_"));
  if (status.has_result()) fmt::print("\n{}", describe(status.result()));
  if (response.scene().constraints().empty()) return;
  Table table(constraint_heading());
  for (const auto& constraint : response.scene().constraints()) table.add(row(constraint));
  fmt::print("\n{}", table.text());
}

struct WaitOptions {
  std::string session;
  std::string until = "final";
  std::optional<std::uint64_t> revision;
  double wait_s = 60;
};

/// Returns the newest revision.
std::uint64_t show_progress(Context& context, const v1::WaitRequest& wait, ProgressBar& bar) {
  v1::GetSessionRequest request;
  request.set_session(wait.session());
  const auto status = context.client().call(request).status();
  if (status.state() == v1::SESSION_STATE_BUILDING)
    bar.show(status.progress().stage(), status.progress().fraction());
  else if (status.revision() < wait.revision())
    bar.show(
        fmt::format("no revision {} yet, the newest is {}", wait.revision(), status.revision()));
  else
    bar.show(fmt::format("solving, revision {}", status.revision()));
  return status.revision();
}

/// Waits in short stretches and looks at the session in between; what takes less than one shows
/// nothing.
v1::ResultInfo wait_with_progress(Context& context, v1::WaitRequest request, double wait_s) {
  constexpr double kStretch = 0.4;  // [s]
  ProgressBar bar;
  const auto deadline = std::chrono::steady_clock::now() + milliseconds(wait_s);
  std::uint64_t newest = request.revision();
  while (true) {
    const std::chrono::duration<double> left = deadline - std::chrono::steady_clock::now();
    if (left.count() <= 0)
      throw client::ClientError(
          v1::ERROR_CODE_TIMEOUT, "",
          newest < request.revision()
              ? fmt::format("there is no revision {} yet, the newest is {}; waited {:g} s for it",
                            request.revision(), newest, wait_s)
              : fmt::format("no such result within {:g} s", wait_s));
    const double stretch = std::min(kStretch, left.count());
    request.set_timeout_s(stretch);
    try {
      return context.client()
          .call(request, milliseconds(stretch) + context.client().options().timeout)
          .result();
    } catch (const client::Unreachable&) {
      throw;
    } catch (const client::ClientError& error) {
      if (error.code() != v1::ERROR_CODE_TIMEOUT) throw;
    }
    newest = show_progress(context, request, bar);
  }
}

void wait(Context& context, const WaitOptions& options) {
  v1::WaitRequest request;
  request.set_session(options.session);
  if (options.revision) {
    request.set_revision(*options.revision);
  } else {
    v1::GetSessionRequest newest;
    newest.set_session(options.session);
    request.set_revision(context.client().call(newest).status().revision());
  }
  request.set_until(wait_until(options.until));
  const auto result = wait_with_progress(context, request, options.wait_s);
  note_failure(context, result);
  if (context.json) return print_json(result);
  fmt::print("{}", describe(result));
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

  auto options = std::make_shared<WaitOptions>();
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
    v1::CloseSessionRequest request;
    request.set_session(session);
    const auto response = context.client().call(request, Milliseconds{60000});
    if (context.json) return print_json(response);
    fmt::print("session {} is closed\n", session);
  });

  add_act(app, "cancel", "Stop a running build or solve; the newest result stays",
          [&context](const std::string& session) {
            v1::CancelRequest request;
            request.set_session(session);
            const auto response = context.client().call(request);
            if (context.json) return print_json(response);
            fmt::print("cancelled\n");
          });

  add_act(app, "cold", "Solve the session's problem again from its base motion",
          [&context](const std::string& session) {
            v1::SolveColdRequest request;
            request.set_session(session);
            const auto response = context.client().call(request);
            if (context.json) return print_json(response);
            fmt::print("job {}\n", response.job());
          });
}

}  // namespace limber::cli
