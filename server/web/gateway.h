#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/transport/transport.h"
#include "server/web/options.h"
#include "server/web/probes.h"
#include "server/web/token.h"

namespace limber::server::web {

/// Pages' way in: files by HTTP, and for each page WebSockets on which it is a client of the
/// transport as others are. A thread of its own.
class Gateway {
 public:
  /// Binds. @throws Refusal or Error{kIo} naming the option
  Gateway(const Options& options, Transport& transport, Counters& counters, Probes probes = {});
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  void start();
  /// Sends what waits and closes the connections, within half a second. After the transport was
  /// stopped. Idempotent.
  void stop();
  /// On the gateway's thread, in turn. Not where it stops before. Any thread.
  void call(std::function<void()> task);

  /// http://HOST:PORT
  [[nodiscard]] const std::string& url() const { return url_; }
  [[nodiscard]] const Tokens& tokens() const;

 private:
  struct Inside;
  std::string url_;
  std::unique_ptr<Inside> inside_;
};

}  // namespace limber::server::web
