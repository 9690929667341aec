#include "clients/cli/starting.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "clients/cpp/server.h"
#include "engine/base/checked_number.h"

namespace limber::cli {
namespace {

namespace fs = std::filesystem;
using client::ClientError;
using client::Milliseconds;

/// The stream endpoint for that of requests: the next port, or the path with .stream behind it.
std::string stream_beside(const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  if (endpoint.starts_with("tcp://") && colon > 5) {
    if (const auto port = parse_number<std::uint16_t>(std::string_view(endpoint).substr(colon + 1)))
      return endpoint.substr(0, colon + 1) + std::to_string(*port + 1);
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
  return (state_folder() / log_name(endpoint)).string();
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

/// The last lines written to a file since it had `begin` bytes.
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

}  // namespace

std::filesystem::path state_folder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder = state != nullptr && *state != 0 ? fs::path(state)
                    : home != nullptr && *home != 0 ? fs::path(home) / ".local" / "state"
                                                    : fs::temp_directory_path();
  folder /= "limber";
  std::error_code ignored;
  fs::create_directories(folder.parent_path(), ignored);
  ::mkdir(folder.c_str(), 0700);  // tokens are kept in it
  return folder;
}

bool hands_over(const StartOptions& options, const std::string& name) {
  return std::any_of(options.more.begin(), options.more.end(), [&](const std::string& word) {
    return word == name || word.starts_with(name + "=");
  });
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

Start start_server(const Context& context, const StartOptions& options,
                   v1::GetServerInfoResponse& info) {
  if (answers(context, Milliseconds{300}, info)) return Start::kRunsAlready;
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
  return Start::kStarted;
}

}  // namespace limber::cli
