#pragma once

#include <boost/asio/io_context.hpp>
#include <deque>
#include <memory>
#include <string>
#include <unordered_map>

#include "server/transport/counters.h"
#include "server/transport/transport.h"
#include "server/web/door.h"
#include "server/web/files.h"
#include "server/web/options.h"
#include "server/web/probes.h"
#include "server/web/shares.h"

namespace limber::server::web {

/// A connection that can be ended from outside.
class Closable {
 public:
  Closable() = default;
  virtual ~Closable() = default;
  Closable(const Closable&) = delete;
  Closable& operator=(const Closable&) = delete;

  /// The server stops: what waits is sent, then the connection is closed with a reason.
  virtual void finish() = 0;
  virtual void drop() = 0;  // at once
};

/// What all connections share. The gateway's thread alone uses it.
struct Site {
  Site(Options given, Transport& its_transport, Counters& its_counters, const std::string& token,
       Probes its_probes)
      : options(std::move(given)),
        transport(its_transport),
        counters(its_counters),
        probes(std::move(its_probes)),
        door(token, options.hosts),
        files(options.root),
        shares(options.connections, options.message_bytes) {}

  const Options options;
  Transport& transport;
  Counters& counters;
  const Probes probes;
  const Door door;
  const Files files;
  Shares shares;
  std::deque<std::weak_ptr<Closable>> visitors;  // those that are no WebSockets, the oldest first
  // WebSockets, which nothing else keeps while they neither read nor write.
  std::unordered_map<Closable*, std::shared_ptr<Closable>> sockets;
  bool is_stopping = false;
  boost::asio::io_context io{1};  // last: its pending handlers end before the members that they use
};

}  // namespace limber::server::web
