#pragma once

#include <string>

#include "server/cli/serve.h"
#include "server/service/server.h"

namespace limber::server {

/// Handles SIGHUP: options are read again, and those that may change while the server runs are
/// applied. Either all of them are, or, where anything is wrong, none. Sessions, sockets and
/// subscribers stay as they are.
class Reload {
 public:
  Reload(Server& server, ServeOptions options) : server_(server), options_(std::move(options)) {}

  /// The log reports changes, options that would need a restart, and errors.
  void operator()();

 private:
  void apply(const ServeOptions& next);
  /// @returns whether an option may change while the server runs
  [[nodiscard]] bool is_live(const std::string& name) const;

  Server& server_;
  ServeOptions options_;  // in force
};

}  // namespace limber::server
