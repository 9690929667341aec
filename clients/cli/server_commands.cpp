// start, stop, info, jobs: the server itself.

#include <fmt/format.h>

#include <map>
#include <thread>

#include "clients/cli/context.h"
#include "clients/cli/print.h"
#include "clients/cli/starting.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

using client::ClientError;
using client::Milliseconds;

/// `limber web` shows them.
void hide_tokens(v1::GetServerInfoResponse& info) {
  info.clear_web_token();
  info.clear_web_tokens();
}

void print_started(const Context& context, v1::GetServerInfoResponse info, const char* how) {
  hide_tokens(info);
  if (context.json)
    print_json(info);
  else
    fmt::print("limberd {} {} at {}, stream at {}\n", info.server_version(), how, context.endpoint,
               info.stream_endpoint());
}

void start(Context& context, const StartOptions& options) {
  v1::GetServerInfoResponse info;
  if (start_server(context, options, info) == Start::kStarted)
    return print_started(context, info, "started");
  if (!options.more.empty())
    fmt::print(stderr, "note: a server runs already; the options after -- are not applied\n");
  print_started(context, info, "already runs");
}

void stop(Context& context, double wait_s) {
  client::shut_down(context.client());
  v1::GetServerInfoResponse info;
  const auto deadline = std::chrono::steady_clock::now() + milliseconds(wait_s);
  while (true) {
    try {
      if (!answers(context, Milliseconds{200}, info)) break;
    } catch (const ClientError& error) {
      if (error.code() != v1::ERROR_CODE_SHUTTING_DOWN) throw;
      std::this_thread::sleep_for(Milliseconds{50});
    }
    if (std::chrono::steady_clock::now() > deadline)
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "", "limberd still answers");
  }
  if (context.json)
    print_json(v1::ShutdownResponse{});
  else
    fmt::print("limberd at {} has stopped\n", context.endpoint);
}

void info(Context& context) {
  auto info = client::server_info(context.client());
  hide_tokens(info);
  if (context.json) return print_json(info);
  std::string versions;
  for (const auto version : info.protocol_versions()) versions += fmt::format(" {}", version);
  fmt::print("limberd {}, protocol{}, up {:.0f} s\nrequests  {}\nstream    {}\ninstance  {}\n",
             info.server_version(), versions, info.uptime_s(), context.endpoint,
             info.stream_endpoint(), info.instance());
  if (!info.web().empty()) fmt::print("pages     {}\n", info.web());
  if (info.role() != v1::ROLE_UNSPECIFIED) fmt::print("you may   {}\n", role_words(info.role()));
  const auto& limits = info.limits();
  Table table({"limit", "value"});
  table.add({"bytes of a message", std::to_string(limits.message_bytes())});
  table.add({"sessions", std::to_string(limits.sessions())});
  table.add({"tets of a mesh", std::to_string(limits.mesh_tets())});
  table.add({"frames", std::to_string(limits.frames())});
  table.add({"constraints", std::to_string(limits.constraints())});
  table.add({"jobs", std::to_string(limits.jobs())});
  table.add({"bytes of a session", std::to_string(limits.session_bytes())});
  fmt::print("\n{}", table.text());
  if (info.counters().empty()) return;
  Table counters({"counter", "value"});
  for (const auto& [name, value] :
       std::map<std::string, std::uint64_t>(info.counters().begin(), info.counters().end()))
    counters.add({name, std::to_string(value)});
  fmt::print("\n{}", counters.text());
}

void jobs(Context& context) {
  const auto response = client::list_jobs(context.client());
  if (context.json) return print_json(response);
  Table table({"job", "kind", "session", "state", "stage", "done", "seconds"});
  for (const auto& job : response.jobs())
    table.add({std::to_string(job.job()), job.kind(), job.session(),
               words(v1::JobState_Name(job.state()), "JOB_STATE_"), job.progress().stage(),
               fmt::format("{:.0f} %", 100 * job.progress().fraction()),
               fmt::format("{:.1f}", job.elapsed_s())});
  fmt::print("{}", table.text());
}

}  // namespace

void add_server_commands(CLI::App& app, Context& context) {
  auto start_options = std::make_shared<StartOptions>();
  auto* command = subcommand(
      app, "start", "Start limberd in the background unless one answers; wait until it is ready",
      "limber start --log /var/log/limberd.log -- --log-level debug");
  command->add_option("--stream", start_options->stream,
                      "Endpoint of the stream (default: beside the requests)");
  command->add_option("--log", start_options->log,
                      "File for what limberd prints (default: in ~/.local/state/limber)");
  command->add_option("--wait", start_options->wait_s, "Seconds to wait until it is ready")
      ->check(seconds_in(0.1, 3600))
      ->capture_default_str();
  command->add_option("limberd_options", start_options->more,
                      "After --: options handed to limberd (`limberd --help`)");
  command->callback([&context, start_options] { start(context, *start_options); });

  auto wait_s = std::make_shared<double>(20);
  command = subcommand(app, "stop", "Ask limberd to end, and wait until it has", "limber stop");
  command->add_option("--wait", *wait_s, "Seconds to wait for its end")
      ->check(seconds_in(0.1, 3600))
      ->capture_default_str();
  command->callback([&context, wait_s] { stop(context, *wait_s); });

  command = subcommand(app, "info", "Version, limits and counters of the server",
                       "limber info --json | jq .counters");
  command->callback([&context] { info(context); });

  command = subcommand(app, "jobs", "Builds and solves, running and recent", "limber jobs");
  command->callback([&context] { jobs(context); });
}

}  // namespace limber::cli
