// status: summary of the server, for administrators.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "clients/cli/context.h"
#include "clients/cli/print.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

using Info = v1::GetServerInfoResponse;

double count_of(const Info& info, const char* counter) {
  const auto found = info.counters().find(counter);
  return found == info.counters().end() ? 0 : static_cast<double>(found->second);
}

double edits(const Info& info) {
  double edits = 0;
  for (const auto count : info.status().acknowledgements().counts())
    edits += static_cast<double>(count);
  return edits;
}

double messages(const Info& info) {
  return count_of(info, "published") + count_of(info, "web_published");
}

/// Rate of a counter: per second since the start, and in between.
struct Rate {
  double since_start = 0, now = 0;
};

template <class Count>
Rate rate(const Count& count, const Info& before, const Info& after) {
  const double between = after.uptime_s() - before.uptime_s();
  return {after.uptime_s() > 0 ? count(after) / after.uptime_s() : 0,
          between > 0 ? (count(after) - count(before)) / between : 0};
}

std::string seconds(double s) {
  if (s < 1e-3) return fmt::format("{:.0f} us", s * 1e6);
  if (s < 1) return fmt::format("{:.1f} ms", s * 1e3);
  if (s < 120) return fmt::format("{:.1f} s", s);
  if (s < 7200) return fmt::format("{:.0f} min", s / 60);
  return s < 172'800 ? fmt::format("{:.1f} h", s / 3600) : fmt::format("{:.1f} days", s / 86'400);
}

std::string bytes(double count) {
  if (count < 1e4) return fmt::format("{:.0f} B", count);
  if (count < 1e7) return fmt::format("{:.0f} kB", count * 1e-3);
  return count < 1e10 ? fmt::format("{:.0f} MB", count * 1e-6)
                      : fmt::format("{:.1f} GB", count * 1e-9);
}

std::string bytes(std::uint64_t count) { return bytes(static_cast<double>(count)); }

/// The upper end of the class that has the latency of which `share` of all are at most.
std::string within(const v1::LatencyHistogram& latencies, double share) {
  double all = 0, sum = 0;
  for (const auto count : latencies.counts()) all += static_cast<double>(count);
  for (int i = 0; i < latencies.bounds_s_size(); ++i) {
    sum += static_cast<double>(latencies.counts(i));
    if (sum >= share * all) return seconds(std::min(latencies.bounds_s(i), latencies.longest_s()));
  }
  return seconds(latencies.longest_s());
}

const v1::SessionUse* slowest(const v1::ServerStatus& status) {
  const v1::SessionUse* slowest = nullptr;
  for (const auto& session : status.sessions()) {
    const double longest = slowest == nullptr ? 0 : slowest->longest_solve_s();
    if (session.longest_solve_s() > longest) slowest = &session;
  }
  return slowest;
}

void print_sessions(const v1::ServerStatus& status) {
  if (status.sessions().empty()) {
    fmt::print("sessions   none\n");
    return;
  }
  Table table({"session", "kind", "state", "people", "memory", "edits", "newest solve", "longest"});
  for (const auto& one : status.sessions())
    table.add({one.session(), one.kind(), one.state(), std::to_string(one.people()),
               one.has_bytes() ? bytes(one.bytes()) : "", std::to_string(one.edits()),
               one.solves() > 0 ? seconds(one.newest_solve_s()) : "",
               one.solves() > 0 ? seconds(one.longest_solve_s()) : ""});
  fmt::print("\n{}\n", table.text());
}

void print_slowest(const v1::ServerStatus& status) {
  const auto& latencies = status.acknowledgements();
  if (latencies.longest_s() > 0)
    fmt::print("acks       half within {}, 99 % within {}, longest {}\n", within(latencies, 0.5),
               within(latencies, 0.99), seconds(latencies.longest_s()));
  if (const auto* one = slowest(status))
    fmt::print("slowest    session {}: {} from an edit to its final result\n", one->session(),
               seconds(one->longest_solve_s()));
}

/// Clients that follow streams, and each with waiting messages.
void print_streams(const Info& info) {
  constexpr int kMost = 8;
  const auto& queues = info.status().queues();
  if (queues.stream_limit_bytes() == 0) return;  // an older server
  fmt::print("streams    {} followed, {} of {} unread, {:.0f} cut off as nothing was read\n",
             queues.reader_count(), bytes(queues.stream_bytes()),
             bytes(queues.stream_limit_bytes()), count_of(info, "stalled"));
  int printed = 0;
  for (const auto& reader : queues.readers()) {
    const bool is_behind = reader.waiting_bytes() > 0 || reader.left_out() > 0;
    if (!is_behind || printed++ >= kMost) continue;
    fmt::print("  {}: {} unread, {} wait, {} messages sent, {} left out{}\n", reader.name(),
               bytes(reader.unread_bytes()), bytes(reader.waiting_bytes()), reader.sent(),
               reader.left_out(),
               reader.stalled_s() > 0 ? ", no credit for " + seconds(reader.stalled_s()) : "");
  }
  printed = 0;
  for (const auto& client : queues.unread_clients()) {
    if (printed++ >= kMost) break;
    fmt::print("  client {}: {} of replies unread\n", client.client(),
               bytes(client.unread_bytes()));
  }
}

void print_store(const Info& info) {
  if (!info.has_store()) {
    fmt::print("store      none: sessions end with the server\n");
    return;
  }
  const auto& store = info.store();
  fmt::print("store      {} ({} parked), {} ({} of them the log), {} in {} ({} synced)\n",
             counted(store.sessions(), "session"), store.parked(), bytes(store.bytes()),
             bytes(store.log_bytes()), counted(store.changes(), "change"),
             counted(store.commits(), "commit"), store.synced_commits());
  if (!store.warning().empty()) fmt::print("           warning: {}\n", store.warning());
}

void print(const Context& context, const Info& before, const Info& info) {
  const auto& status = info.status();
  const auto& process = status.process();
  const auto& queues = status.queues();
  fmt::print("limberd {} at {}, {}, up {}\n", info.server_version(), context.endpoint,
             words(v1::ServerStatus::Phase_Name(status.phase()), "PHASE_"),
             seconds(info.uptime_s()));
  if (!info.web().empty())
    fmt::print("pages      {}, {:.0f} WebSockets\n", info.web(), count_of(info, "web_connections"));
  print_sessions(status);
  const auto rates = [&](const char* what, const Rate& rate) {
    fmt::print("{:<10} {:.1f}/s now, {:.2f}/s since the start\n", what, rate.now, rate.since_start);
  };
  rates("edits", rate(edits, before, info));
  rates("stream", rate(messages, before, info));
  print_slowest(status);
  fmt::print(
      "requests   {:.0f}, {:.0f} of them errors, {:.0f} malformed; {} unanswered, {} wait "
      "for a thread; {} jobs run\n",
      count_of(info, "requests"), count_of(info, "errors"), count_of(info, "malformed"),
      queues.open_requests(), queues.heavy_requests(), status.running_jobs());
  fmt::print("queues     {} of replies, {} of requests, {} of streams for pages\n",
             bytes(queues.unread_bytes()), bytes(queues.heavy_bytes()), bytes(queues.page_bytes()));
  print_streams(info);
  fmt::print(
      "dropped    {:.0f} requests, {:.0f} replies; stream messages: {:.0f} given up for "
      "newer ones, {:.0f} missed\n",
      count_of(info, "dropped_requests"),
      count_of(info, "dropped_replies") + count_of(info, "refused_replies"),
      count_of(info, "replaced"), count_of(info, "forced"));
  fmt::print(
      "process    {} in memory, {:.1f} s of processor time, {} of {} files open, {} "
      "threads\n",
      bytes(process.resident_bytes()), process.cpu_s(), process.open_files(),
      process.most_open_files(), process.threads());
  print_store(info);
  for (const auto& reason : status.not_ready()) fmt::print("NOT READY  {}\n", reason);
  for (const auto& fault : status.faults()) fmt::print("FAULT      {}\n", fault);
}

std::string json_of(const Rate& rate) {
  return fmt::format(R"({{"now_per_s":{},"since_start_per_s":{}}})", rate.now, rate.since_start);
}

/// The answer of GetServerInfo, and the rates with it.
void print_all_as_json(const Info& before, const Info& info) {
  std::string all = to_json(info);
  all.pop_back();  // its brace
  fmt::print("{},\"rates\":{{\"edits\":{},\"stream_messages\":{}}}}}\n", all,
             json_of(rate(edits, before, info)), json_of(rate(messages, before, info)));
}

Info ask(Context& context) {
  auto info = client::server_status(context.client());
  info.clear_web_token();  // `limber web` shows it
  return info;
}

void status(Context& context, double measured_s) {
  const Info before = ask(context);
  std::this_thread::sleep_for(std::chrono::duration<double>(measured_s));
  const Info after = measured_s > 0 ? ask(context) : before;
  if (!after.has_status())
    throw client::ClientError(v1::ERROR_CODE_UNSUPPORTED, "",
                              "this limberd is too old to tell how it does");
  context.json ? print_all_as_json(before, after) : print(context, before, after);
  if (!after.status().faults().empty()) context.exit_code = kRefused;
}

}  // namespace

void add_status_command(CLI::App& app, Context& context) {
  auto measured_s = std::make_shared<double>(1);
  auto* command = subcommand(
      app, "status", "How the server does, at one look; exits with 1 where something is wrong",
      "limber status --json | jq .rates.edits.now_per_s");
  command
      ->add_option("--measure", *measured_s,
                   "Seconds over which rates of now are measured; 0: none")
      ->check(seconds_in(0, 3600))
      ->capture_default_str();
  command->callback([&context, measured_s] { status(context, *measured_s); });
}

}  // namespace limber::cli
