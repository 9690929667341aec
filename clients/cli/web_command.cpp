// web: the page of a server, in the browser.

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <iterator>
#include <random>

#include "clients/cli/context.h"
#include "clients/cli/print.h"
#include "clients/cli/starting.h"
#include "clients/cpp/error.h"

namespace limber::cli {
namespace {

using client::ClientError;

struct WebOptions {
  StartOptions start;
  bool no_open = false;
  std::string role;  // of the page; empty: that of the requesting client
};

#ifdef __APPLE__
constexpr const char* kOpener = "open";
bool has_display() { return true; }
#else
constexpr const char* kOpener = "xdg-open";
bool has_display() {
  const auto is_set = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != 0;
  };
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}
#endif

/// Address for a browser on this machine of a server that is bound to all addresses.
std::string reachable(std::string url) {
  for (const auto& [any, own] :
       {std::pair{"://0.0.0.0:", "://127.0.0.1:"}, {"://[::]:", "://[::1]:"}}) {
    if (const auto at = url.find(any); at != std::string::npos)
      url.replace(at, std::string(any).size(), own);
  }
  return url;
}

/// Other users of this machine see the arguments of a program. On loopback without keys they may
/// ask the server for the token anyway.
bool is_secret(const Context& context) {
  return !context.endpoint.starts_with("tcp://") || !context.key_file.empty();
}

/// Whether the desktop's program for it took the address.
bool open_in_browser(const std::string& url) {
  std::array<char*, 3> argv{const_cast<char*>(kOpener), const_cast<char*>(url.c_str()), nullptr};
  const pid_t child = fork();
  if (child == 0) {
    const int nothing = ::open("/dev/null", O_RDWR);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, stream);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

/// A token that outlasts the server: open pages come back to one that is started anew. Readable by
/// its owner alone. Empty where it cannot be kept.
std::string kept_token_file() {
  const std::string file = (state_folder() / "web-token").string();
  const int made = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (made < 0) return errno == EEXIST ? file : std::string();
  std::random_device random;  // of the operating system
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", random());
  token += '\n';
  const bool written = ::write(made, token.data(), token.size()) == std::ssize(token);
  ::close(made);
  if (!written) ::unlink(file.c_str());
  return written ? file : std::string();
}

/// @throws ClientError PERMISSION_DENIED
std::string token_of(const v1::GetServerInfoResponse& info, const std::string& role) {
  if (role.empty()) return info.web_token();
  for (const auto& token : info.web_tokens()) {
    if (role_words(token.role()) == role) return token.token();
  }
  if (info.role() == v1::ROLE_UNSPECIFIED)
    throw ClientError(v1::ERROR_CODE_UNSUPPORTED, "--role",
                      fmt::format("this server ({}) does not know roles: update the server",
                                  info.server_version()));
  throw ClientError(
      v1::ERROR_CODE_PERMISSION_DENIED, "--role",
      fmt::format("a page that may {} is shown by those who may themselves; this client has "
                  "the role {}",
                  role, role_words(info.role())));
}

void show_page(Context& context, WebOptions options) {
  const bool has_more = !options.start.more.empty();
  if (!hands_over(options.start, "--web")) options.start.more.emplace_back("--web");
  if (!hands_over(options.start, "--web-token-file")) {
    if (const std::string file = kept_token_file(); !file.empty())
      options.start.more.insert(options.start.more.end(), {"--web-token-file", file});
  }
  v1::GetServerInfoResponse info;
  const Start start = start_server(context, options.start, info);
  if (info.web().empty() || info.web_token().empty())
    throw ClientError(
        v1::ERROR_CODE_FAILED_PRECONDITION, "--web",
        fmt::format(
            "the limberd at {} serves no pages: it was started without --web. `limber stop` "
            "ends it with its sessions; `limber web` then starts one that does",
            context.endpoint));
  if (start == Start::kRunsAlready && has_more)
    fmt::print(stderr, "note: a server runs already; the options after -- are not applied\n");
  const std::string url =
      fmt::format("{}/?token={}", reachable(info.web()), token_of(info, options.role));
  if (context.json) {
    fmt::print("{{\"url\":\"{}\"}}\n", url);
  } else {
    fmt::print("{}\n", url);
  }
  if (options.no_open || !has_display()) return;
  if (is_secret(context)) {
    fmt::print(stderr,
               "note: not opened, since other users would see the token in the list of "
               "processes: open the address yourself\n");
  } else if (!open_in_browser(url)) {
    fmt::print(stderr, "note: {} did not open it: open the address yourself\n", kOpener);
  }
}

}  // namespace

void add_web_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<WebOptions>();
  auto* command = subcommand(app, "web",
                             "Print the address of the server's page, with its token, and open it; "
                             "start a server unless one "
                             "answers",
                             "limber web --no-open -- --web 127.0.0.1:9000");
  command->add_flag("--no-open", options->no_open, "Only print it");
  command
      ->add_option("--role", options->role,
                   "What the page may do: view, edit or administer (default: what you may)")
      ->check(CLI::IsMember({"view", "edit", "administer"}));
  command->add_option("--log", options->start.log,
                      "File for what limberd prints (default: in ~/.local/state/limber)");
  command->add_option("--wait", options->start.wait_s, "Seconds to wait until it is ready")
      ->check(seconds_in(0.1, 3600))
      ->capture_default_str();
  command->add_option("limberd_options", options->start.more,
                      "After --: options handed to limberd (`limberd --help`)");
  command->callback([&context, options] { show_page(context, *options); });
}

}  // namespace limber::cli
