#include "server/web/gateway.h"

#include <fmt/format.h>

#include <future>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "engine/base/checked_number.h"
#include "server/log/log.h"
#include "server/web/site.h"
#include "server/web/token.h"
#include "server/web/visitor.h"
#include "server/wire/errors.h"

namespace limber::server::web {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using Fault = boost::system::error_code;

constexpr std::chrono::milliseconds kTimeToStop{500};
constexpr std::chrono::milliseconds kPauseAfterFault{100};  // no descriptor is free

tcp::endpoint endpoint_of(const std::string& address) {
  const auto colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host == "localhost") host = "127.0.0.1";
  if (host == "*") host = "0.0.0.0";
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  // validate() has checked that it is a port, or *, which is any.
  const auto port = parse_number<unsigned short>(std::string_view(address).substr(colon + 1));
  Fault fault;
  const auto ip = asio::ip::make_address(host, fault);
  if (fault) throw invalid("--web", fmt::format("'{}' is no IP address, nor localhost", host));
  return {ip, port.value_or(0)};
}

std::string url_of(const tcp::endpoint& endpoint) {
  const auto& ip = endpoint.address();
  const std::string host = ip.is_v6() ? fmt::format("[{}]", ip.to_string()) : ip.to_string();
  return fmt::format("http://{}:{}", host, endpoint.port());
}

}  // namespace

struct Gateway::Inside {
  Inside(const Options& options, Transport& transport, Counters& counters, const std::string& token,
         Probes probes)
      : site(options, transport, counters, token, std::move(probes)),
        acceptor(site.io),
        pause(site.io),
        work(asio::make_work_guard(site.io)) {}

  void bind() {
    const tcp::endpoint endpoint = endpoint_of(site.options.address);
    try {
      acceptor.open(endpoint.protocol());
      acceptor.set_option(tcp::acceptor::reuse_address(true));
      acceptor.bind(endpoint);
      acceptor.listen();
    } catch (const boost::system::system_error& fault) {
      throw Error(ErrorCode::kIo, "--web",
                  fmt::format("cannot bind {}: {}", site.options.address, fault.code().message()));
    }
  }

  void accept() {
    acceptor.async_accept([this](const Fault& fault, tcp::socket socket) {
      if (fault == asio::error::operation_aborted || site.is_stopping) return;
      if (!fault) {
        welcome(site, std::move(socket));
        return accept();
      }
      log::warn("web: {}", fault.message());
      pause.expires_after(kPauseAfterFault);
      pause.async_wait([this](const Fault& aborted) {
        if (!aborted) accept();
      });
    });
  }

  void run() {
    while (true) {
      try {
        site.io.run();
        return;
      } catch (const std::exception& fault) {
        log::error("web: {}", fault.what());
      }
    }
  }

  void finish() {
    site.is_stopping = true;
    Fault ignored;
    acceptor.close(ignored);
    pause.cancel();
    for (const auto& visitor : std::exchange(site.visitors, {})) {
      if (const auto open = visitor.lock()) open->finish();
    }
    // They leave the map while they finish.
    for (const auto& [unused, socket] : std::unordered_map(site.sockets)) socket->finish();
    work.reset();
  }

  /// Drops connections that have not finished in time.
  void drop_all() {
    for (const auto& [unused, socket] : std::exchange(site.sockets, {})) socket->drop();
  }

  Site site;
  tcp::acceptor acceptor;
  asio::steady_timer pause;
  asio::executor_work_guard<asio::io_context::executor_type> work;
  std::thread thread;
  std::promise<void> ended;
};

Gateway::Gateway(const Options& options, Transport& transport, Counters& counters, Probes probes) {
  options.validate();
  inside_ = std::make_unique<Inside>(
      options, transport, counters,
      options.token_file.empty() ? make_token() : read_token(options.token_file),
      std::move(probes));
  inside_->bind();
  url_ = url_of(inside_->acceptor.local_endpoint());
}

Gateway::~Gateway() { stop(); }

const Tokens& Gateway::tokens() const { return inside_->site.door.tokens(); }

void Gateway::start() {
  inside_->thread = std::thread([inside = inside_.get()] {
    inside->accept();
    inside->run();
    inside->ended.set_value();
  });
}

void Gateway::call(std::function<void()> task) { asio::post(inside_->site.io, std::move(task)); }

void Gateway::stop() {
  if (!inside_->thread.joinable()) return;
  asio::post(inside_->site.io, [inside = inside_.get()] { inside->finish(); });
  if (inside_->ended.get_future().wait_for(kTimeToStop) == std::future_status::timeout)
    inside_->site.io.stop();
  inside_->thread.join();
  inside_->drop_all();
}

}  // namespace limber::server::web
