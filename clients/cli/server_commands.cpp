// start, stop, info, jobs: the server itself.

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "clients/cli/context.h"
#include "clients/cli/print.h"
#include "clients/cpp/server.h"

namespace limber::cli {
namespace {

namespace fs = std::filesystem;
using client::ClientError;
using client::Milliseconds;

struct StartOptions {
  std::string stream, log;
  double wait_s = 20;
  std::vector<std::string> more;
};

/// The stream beside the requests: the next port, or the path with .stream behind it.
std::string stream_beside(const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  if (endpoint.starts_with("tcp://") && colon > 5) {
    const std::string port = endpoint.substr(colon + 1);
    if (!port.empty() && port.find_first_not_of("0123456789") == std::string::npos &&
        port.size() <= 5)
      return endpoint.substr(0, colon + 1) + std::to_string(std::stoi(port) + 1);
  }
  if (endpoint.starts_with("ipc://")) return endpoint + ".stream";
  throw ClientError(
      v1::ERROR_CODE_INVALID_ARGUMENT, "endpoint",
      "to start a server, the endpoint is tcp://HOST:PORT or ipc://PATH, not '" + endpoint + "'");
}

/// One for each endpoint, so that servers do not write into each other's: limberd-PORT.log,
/// limberd-NAME-HASH.log of an ipc path.
std::string log_name(const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  const std::string port = endpoint.substr(colon == std::string::npos ? 0 : colon + 1);
  if (endpoint.starts_with("tcp://") && !port.empty() &&
      port.find_first_not_of("0123456789") == std::string::npos)
    return "limberd-" + port + ".log";
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : endpoint) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return fmt::format("limberd-{}-{:08x}.log", fs::path(endpoint).filename().string(), hash);
}

std::string default_log(const std::string& endpoint) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder = state != nullptr && *state != 0 ? fs::path(state)
                    : home != nullptr && *home != 0 ? fs::path(home) / ".local" / "state"
                                                    : fs::temp_directory_path();
  folder /= "limber";
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  return (folder / log_name(endpoint)).string();
}

/// Starts a program in a session of its own, its output appended to a file.
pid_t spawn(const std::vector<std::string>& arguments, const std::string& log) {
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (out < 0) throw ClientError(v1::ERROR_CODE_IO, "log", "cannot write " + log);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    setsid();
    const int nothing = ::open("/dev/null", O_RDONLY);
    dup2(nothing, STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(out);
  if (child < 0) throw ClientError(v1::ERROR_CODE_IO, "limberd", "cannot start another process");
  return child;
}

bool answers(const Context& context, Milliseconds patience, v1::GetServerInfoResponse& info) {
  auto options = context.client_options();
  options.timeout = patience;
  client::Client client(context.endpoint, options);
  try {
    info = client::greet(client);
    return true;
  } catch (const client::ServerStopped&) {
    throw;
  } catch (const client::Unreachable&) {
    return false;
  }
}

void print_started(const Context& context, const v1::GetServerInfoResponse& info, const char* how) {
  if (context.json)
    print_json(info);
  else
    fmt::print("limberd {} {} at {}, stream at {}\n", info.server_version(), how, context.endpoint,
               info.stream_endpoint());
}

/// Whether one of limberd's options is among those after `--`, as `--name X` or `--name=X`.
bool hands_over(const StartOptions& options, const std::string& name) {
  return std::any_of(options.more.begin(), options.more.end(), [&](const std::string& word) {
    return word == name || word.starts_with(name + "=");
  });
}

std::vector<std::string> limberd_command(const Context& context, const StartOptions& options) {
  if (hands_over(options, "--bind"))
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "--bind",
                      "`limber start` binds limberd to its own endpoint: "
                      "`limber --endpoint ENDPOINT start`");
  const bool stream_handed_over = hands_over(options, "--stream");
  if (stream_handed_over && !options.stream.empty())
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "--stream",
                      "--stream is given both before and after --");
  std::vector<std::string> arguments = {find_limberd(), "--bind", context.endpoint,
                                        "--allow-shutdown"};
  if (!stream_handed_over) {
    arguments.emplace_back("--stream");
    arguments.push_back(options.stream.empty() ? stream_beside(context.endpoint) : options.stream);
  }
  arguments.insert(arguments.end(), options.more.begin(), options.more.end());
  return arguments;
}

/// The last lines of what was written to a file since it had `begin` bytes.
std::string newest_lines(const std::string& file, std::uintmax_t begin) {
  constexpr std::size_t kLines = 3;
  std::ifstream in(file);
  in.seekg(static_cast<std::streamoff>(begin));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);)
    if (!line.empty()) lines.push_back(line);
  std::string text;
  for (std::size_t i = lines.size() - std::min(lines.size(), kLines); i < lines.size(); ++i)
    text += "\n  " + lines[i];
  return text;
}

std::uintmax_t size_of(const std::string& file) {
  std::error_code missing;
  const auto size = fs::file_size(file, missing);
  return missing ? 0 : size;
}

void start(Context& context, const StartOptions& options) {
  v1::GetServerInfoResponse info;
  if (answers(context, Milliseconds{300}, info)) {
    if (!options.more.empty())
      fmt::print(stderr, "note: a server runs already; the options after -- are not applied\n");
    return print_started(context, info, "already runs");
  }
  const std::string log = options.log.empty() ? default_log(context.endpoint) : options.log;
  const std::uintmax_t logged = size_of(log);
  const pid_t child = spawn(limberd_command(context, options), log);
  const auto deadline = std::chrono::steady_clock::now() + milliseconds(options.wait_s);
  while (!answers(context, Milliseconds{200}, info)) {
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child)
      throw ClientError(
          v1::ERROR_CODE_FAILED_PRECONDITION, "limberd",
          fmt::format("limberd did not start; {} says:{}", log, newest_lines(log, logged)));
    if (std::chrono::steady_clock::now() > deadline)
      throw client::Unreachable(
          fmt::format("limberd (process {}) does not answer; see {}", child, log));
  }
  print_started(context, info, "started");
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
  const auto info = client::server_info(context.client());
  if (context.json) return print_json(info);
  std::string versions;
  for (const auto version : info.protocol_versions()) versions += fmt::format(" {}", version);
  fmt::print("limberd {}, protocol{}, up {:.0f} s\nrequests  {}\nstream    {}\ninstance  {}\n",
             info.server_version(), versions, info.uptime_s(), context.endpoint,
             info.stream_endpoint(), info.instance());
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
