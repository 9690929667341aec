#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "server/kinds/registry.h"
#include "server/log/log.h"
#include "server/web/options.h"

namespace limber::server {

struct ServeOptions {
  ServerOptions server;
  std::optional<web::Options> web;    // the gateway for pages; nothing: none
  std::filesystem::path ready_file;   // written once the sockets are bound; empty: none
  std::filesystem::path curve_allow;  // read again on SIGHUP; empty: none
  log::Level log_level = log::Level::kInfo;
  log::Format log_format = log::Format::kText;
  std::map<std::string, std::string> values;  // of all options by their names, as they are written
  /// The same command line with the present file of `--config`; empty: there is none.
  /// @throws std::exception naming what is wrong
  std::function<ServeOptions()> read_again;

  /// @throws Refusal or Error naming the option
  void validate() const;
};

/// Runs until SIGINT, SIGTERM or a shutdown request; a second of these signals ends the process at
/// once. SIGTERM drains before. SIGHUP reads options and allowed keys again. SIGUSR1 writes how the
/// server does into the log, SIGUSR2 is ignored.
/// @param make_kinds  the kinds that it has
/// @returns the exit code: 1 where changes of sessions are lost, as they could not be stored
int serve(const ServeOptions& options, const MakeKinds& make_kinds);

}  // namespace limber::server
