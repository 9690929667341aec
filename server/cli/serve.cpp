#include "server/cli/serve.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <memory>

#include "engine/base/error.h"
#include "server/cli/reload.h"
#include "server/cli/service_manager.h"
#include "server/cli/watchdog.h"
#include "server/log/log.h"
#include "server/service/server.h"
#include "server/web/token.h"

namespace limber::server {
namespace {

constexpr const char* kServing = "Serving";

std::string json_string(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    out.push_back(c);
  }
  return out + "\"";
}

std::string ready_text(const Server& server) {
  const WebEntrance& web = server.web();
  const std::string pages = web.url.empty()
                                ? ""
                                : fmt::format(", \"web\": {}, \"web_token\": {}",
                                              json_string(web.url), json_string(web.token));
  return fmt::format("{{\"requests\": {}, \"stream\": {}, \"pid\": {}, \"instance\": {}{}}}\n",
                     json_string(server.request_endpoint()), json_string(server.stream_endpoint()),
                     ::getpid(), json_string(server.instance()), pages);
}

/// Written aside and renamed: a reader of the file can read all of it. With a token in it, only its
/// owner can.
void write_ready_file(const std::filesystem::path& path, const Server& server) {
  if (path.empty()) return;
  const std::filesystem::path aside = fmt::format("{}.{}", path.string(), ::getpid());
  const std::string text = ready_text(server);
  std::error_code ignored;
  std::filesystem::remove(aside, ignored);
  const mode_t mode = server.web().token.empty() ? 0666 : 0600;
  const int file = ::open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  const auto written = file < 0 ? -1 : ::write(file, text.data(), text.size());
  if (file >= 0) ::close(file);
  if (written != static_cast<ssize_t>(text.size()))
    throw Error(ErrorCode::kIo, "--ready-file", path.string() + " cannot be written");
  std::filesystem::rename(aside, path);
}

class Signals {
 public:
  Signals(Server& server, const ServeOptions& options)
      : server_(server), reload_(server, options), set_(server.control(), SIGINT, SIGTERM, SIGHUP) {
    set_.add(SIGUSR1);
    listen();
  }

 private:
  void listen() {
    set_.async_wait([this](const boost::system::error_code& fault, int signal) {
      if (fault) return;
      take(signal);
      listen();
    });
  }
  void take(int signal) {
    if (signal == SIGHUP) {
      service_manager::reloading();
      reload_();
      return service_manager::ready(kServing);
    }
    if (signal == SIGUSR1) return server_.log_status();
    if (++count_ > 1) {
      log::warn("signal {} again: leaving at once", signal);
      std::_Exit(128 + signal);
    }
    log::info("signal {}", signal);
    service_manager::stopping(signal == SIGTERM ? "Draining" : "Stopping");
    signal == SIGTERM ? server_.request_drain() : server_.request_stop();
  }

  Server& server_;
  Reload reload_;
  boost::asio::signal_set set_;
  int count_ = 0;
};

/// Null if no watchdog is requested.
std::unique_ptr<Watchdog> make_watchdog(Server& server) {
  constexpr int kLooks = 4;  // within the time of the watchdog
  const auto time = service_manager::watchdog_time();
  if (!time) return nullptr;
  return std::make_unique<Watchdog>(
      server.control(), *time / kLooks,
      [&server](std::function<void()> done) { server.ask_loops(std::move(done)); },
      service_manager::feed_watchdog);
}

}  // namespace

void ServeOptions::validate() const {
  server.validate();
  if (server.store) server.store->validate();
  if (web) web->validate();
  if (web && !web->token_file.empty()) (void)web::read_token(web->token_file);
}

int serve(const ServeOptions& options, const MakeKinds& make_kinds) {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on the size of files is a full disk, not the end
  // They would end the process: the first one is taken once the server runs, the other means
  // nothing.
  std::signal(SIGUSR1, SIG_IGN);
  std::signal(SIGUSR2, SIG_IGN);
  Server server(options.server, make_kinds, options.web);
  const Signals signals(server, options);
  const auto watchdog = make_watchdog(server);
  write_ready_file(options.ready_file, server);
  log::info("limberd {} ready: requests {}, stream {}, instance {}", LIMBER_VERSION,
            server.request_endpoint(), server.stream_endpoint(), server.instance());
  if (!server.web().url.empty())
    log::info("pages at {}; `limber web` prints the address with its token", server.web().url);
  service_manager::ready(kServing);
  const Server::Ending ending = server.run();
  std::error_code ignored;
  if (!options.ready_file.empty()) std::filesystem::remove(options.ready_file, ignored);
  const int code = server.lost_changes() > 0 ? 1 : 0;
  if (ending == Server::Ending::kLate)
    std::_Exit(code);  // a task that does not stop must not hold up the exit
  return code;
}

}  // namespace limber::server
